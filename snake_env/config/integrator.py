"""Time stepping."""

from __future__ import annotations

from dataclasses import dataclass

from snake_env import _checks
from snake_env.config.section import Section, core_defaults
from snake_env.errors import ConfigError

_DEFAULT = core_defaults("integrator")


@dataclass(frozen=True)
class Integrator(Section):
    """Time stepping; ``Integrator()`` is the environments'.

    None takes the default of the method and the model; an option of the other method is refused.

    Args:
        method: "implicit", the fast default; or "thesis", the time stepping and Modified Newton iteration as printed
            (T 3.6.2).
        step: largest step [s], 1e-8 to 1e3; a sample interval is divided into equal steps no longer than this.
            "thesis": 2.5e-4. "implicit": 0.025, and shorter in the first 0.2 s after the robot was placed; 0.01 for the
            spatial model; 0.02 for the minimal model, 2.5e-4 if torques are held over steps. The minimal model's smooth
            plants have a solver that chooses its own.
        tolerance: > 0 and at most 0.01, beyond which sliding is not told from sticking. "thesis": the iteration stops
            when the impulses change by less [N s] (T 3.81), default 2e-5, 1e-5 for the minimal model. "implicit":
            accuracy of the velocities in a stage [m/s], default 1e-6; of a smooth plant of the minimal model the
            relative tolerance.
        max_iterations: after which a solve is given up and counts as unconverged, 1 to 1,000,000; "thesis": 10,000,
            "implicit": 200.
        order: "implicit" only: 1, implicit Euler, or 2, the default, the two-stage SDIRK scheme.
        event_substeps: "implicit" only, order 2: most Euler steps that replace a step whose forces change abruptly,
            before penetrations are considered, 1 to 1000; default 4.
        event_tolerance: "implicit" only, order 2: distance between prediction and end of the second stage beyond which
            forces count as abruptly changed [m], > 0; default the squared step times 0.32 m/s^2, in the spatial model
            4 m/s^2.
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
    event_substeps: int | None = None
    event_tolerance: float | None = None
    r_t: float | None = None
    r_h: float | None = None
    r_n: float | None = None
    r_v: float | None = None

    def __post_init__(self) -> None:
        self._require_integers()
        super().__post_init__()
        if self.order == 1:
            for name in ("event_substeps", "event_tolerance"):
                if (value := getattr(self, name)) is not None:
                    raise ConfigError(f"integrator.{name}", repr(value), "None with order=1, which has no events")

    def _require_integers(self) -> None:
        """The error of the core has another range for what is no integer than for an integer out of range."""
        if self.max_iterations is not None:
            _checks.integer("integrator.max_iterations", self.max_iterations, 1, 2**32 - 1)
        if self.order is not None:
            _checks.integer("integrator.order", self.order, 1, 2)
        if self.event_substeps is not None:
            _checks.integer("integrator.event_substeps", self.event_substeps, 1, 1000)
