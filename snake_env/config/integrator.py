"""Time stepping."""

from __future__ import annotations

from dataclasses import dataclass

from snake_env.config.section import Section, core_defaults

_IMPLICIT = core_defaults("integrator")


@dataclass(frozen=True)
class Integrator(Section):
    """Time stepping; None takes the method's own default, and ``Integrator()`` is the environments'.

    Args:
        method: "implicit", the fast default; or "thesis", the time stepping and Modified Newton iteration as printed
            (T 3.6.2).
        step: largest step [s], > 0; a sample interval is divided into equal steps no longer than this. "thesis":
            2.5e-4. "implicit": 0.025, and shorter in the first 0.2 s after the robot was placed; 0.01 for the spatial
            model; 0.02 for the minimal model, 2.5e-4 if torques are held over steps. The minimal model's smooth plants
            have a solver that chooses its own.
        tolerance: > 0. "thesis": the iteration stops when the impulses change by less [N s] (T 3.81), default 2e-5.
            "implicit": accuracy of the velocities in a stage [m/s], default 1e-6. A smooth plant of the minimal model:
            relative tolerance, default 1e-6.
        max_iterations: after which a solve is given up and counts as unconverged, >= 1.
        order: 1 or 2. "implicit": implicit Euler, or the two-stage SDIRK scheme.
        event_substeps: "implicit", order 2: Euler steps that at most replace a step in which a peg's force changes
            abruptly.
        event_tolerance: "implicit", order 2: deviation of a stage from its prediction beyond which that is so [m],
            > 0; None: the squared step times 0.32 m/s^2, in the spatial model 4 m/s^2.
        r_t: r_T of (T 3.79), > 0; None takes the thesis's, 1.3, 0.2 for the minimal model, 0.01 for the spatial
            model. "thesis" only.
        r_h: r_H of (T 3.78), > 0. "thesis" only.
        r_n: r_N of (T 4.113), > 0. "thesis", the spatial model only.
        r_v: r_V of (T 4.115), > 0. "thesis", the spatial model only.
    """

    _section = "integrator"

    method: str = _IMPLICIT.method
    step: float | None = None
    tolerance: float | None = None
    max_iterations: int | None = None
    order: int = _IMPLICIT.order
    event_substeps: int = _IMPLICIT.event_substeps
    event_tolerance: float | None = None
    r_t: float | None = None
    r_h: float = _IMPLICIT.r_h
    r_n: float = _IMPLICIT.r_n
    r_v: float = _IMPLICIT.r_v
