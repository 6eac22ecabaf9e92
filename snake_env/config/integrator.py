"""Time stepping."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from snake_env import _checks
from snake_env.config.section import Section, core_defaults
from snake_env.errors import ConfigError

_DEFAULT = core_defaults("integrator")

PRECISIONS = ("fast", "default", "fine")


@dataclass(frozen=True)
class Integrator(Section):
    """Time stepping; ``Integrator()`` is the environments'.

    None takes the default of the method and the model; an option of the other method is refused.

    Args:
        method: "implicit", the fast default and the only one of environments; or "thesis", the time stepping and
            Modified Newton iteration as printed (T 3.6.2).
        step: largest step [s], 1e-8 to 1e3; a sample interval is divided into equal steps no longer than this.
            "thesis": 2.5e-4. "implicit": 0.025; 0.02 for the minimal model, 2.5e-4 if torques are held over steps, and
            times the root of what ``precision`` scales. The minimal model's smooth plants have a solver that chooses
            its own.
        tolerance: > 0 and at most 0.01, beyond which sliding is not told from sticking. "thesis": the iteration stops
            when the impulses change by less [N s] (T 3.81), default 2e-5, 1e-5 for the minimal model. "implicit":
            largest residual of a solved stage, as a velocity [m/s], default 1e-4, 1e-5 for the spatial model. What the
            fallback of the plane solves may leave 100 times as much, but no more than 1e-4. Of the minimal model:
            accuracy of the velocities, default 1e-6; of its smooth plants, relative.
        max_iterations: after which a solve is given up and counts as unconverged, 1 to 1,000,000; "thesis": 10,000,
            "implicit": 200.
        order: "implicit" only: 1, implicit Euler, or 2, the default, the two-stage SDIRK scheme.
        step_tolerance: "implicit" only, order 2: largest accepted deviation of any point of the robot from its
            prediction for the end of a part [m], > 0. Parts of a step are as long as it allows. Default 4e-4, 1.5e-4
            for the spatial model, times the cube of ``step`` over 0.025 where that is shorter.
        impact_step: "implicit" only, order 2: length of the implicit Euler steps that take an impact [s], > 0. Default
            1.5e-3, 4e-4 for the spatial model, and at most a quarter of a step.
        precision: "implicit" only: "fast", "default" or "fine", which scales ``tolerance``, ``step_tolerance`` and
            ``impact_step`` together: 2, 1 or 0.05 times their defaults.
        r_t: "thesis" only: r_T of (T 3.79), > 0; default the thesis's, 1.3, 0.2 for the minimal model, 0.01 for the
            spatial model.
        r_h: "thesis" only: r_H of (T 3.78), > 0; default 0.01.
        r_n: "thesis" only, the spatial model: r_N of (T 4.113), > 0; default 0.1.
        r_v: "thesis" only, the spatial model: r_V of (T 4.115), > 0; default 0.05.
    """

    _section = "integrator"

    method: str = _DEFAULT.method
    step: float | None = None
    tolerance: float | None = None
    max_iterations: int | None = None
    order: int | None = None
    step_tolerance: float | None = None
    impact_step: float | None = None
    precision: str | None = None
    r_t: float | None = None
    r_h: float | None = None
    r_n: float | None = None
    r_v: float | None = None

    @classmethod
    def at(cls, precision: str | None, given: Integrator | Mapping[str, Any] | None) -> Integrator:
        """The integrator at a precision, which the options that are given override."""
        chosen = cls.of(given)
        if precision is None:
            return chosen
        _checks.choice("precision", precision, PRECISIONS)
        if chosen.method != "implicit" or chosen.precision is not None:
            return chosen
        return replace(chosen, precision=precision)

    def __post_init__(self) -> None:
        self._require_integers()
        super().__post_init__()
        if self.order == 1:
            for name in ("step_tolerance", "impact_step"):
                if (value := getattr(self, name)) is not None:
                    raise ConfigError(f"integrator.{name}", repr(value), "None with order=1, whose steps are all alike")

    def _require_integers(self) -> None:
        """The error of the core has another range for what is no integer than for an integer out of range."""
        if self.max_iterations is not None:
            _checks.integer("integrator.max_iterations", self.max_iterations, 1, 2**32 - 1)
        if self.order is not None:
            _checks.integer("integrator.order", self.order, 1, 2)
