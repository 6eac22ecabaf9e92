"""Joint references."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env import _checks
from snake_env._native import gait_reference
from snake_env.config.section import DEGREE, Section, core_defaults

_UNDULATION = core_defaults("gait")

MOST_JOINTS = 10_000
"""Of a reference; robots have fewer."""


@dataclass(frozen=True)
class Gait(Section):
    """Joint references: travelling waves, phi_i = A sin(omega t + (i - 1) beta) + gamma (T 2.14), (T 7.1).

    The spatial model has a vertical wave beside it, A_v sin(omega_v t + (i - 1) beta_v + beta_0) (T 2.15), (T 7.2). The
    others take the horizontal wave only: their ``vertical_amplitude`` must be zero.

    Args:
        amplitude: A_h [rad].
        omega: omega_h [rad/s].
        beta: beta_h, phase shift between adjacent joints [rad].
        gamma: gamma_h, common offset that steers [rad].
        vertical_amplitude: A_v [rad] (T 7.2).
        vertical_omega: omega_v [rad/s].
        vertical_beta: beta_v [rad].
        vertical_phase: beta_0, phase of the vertical against the horizontal wave [rad].
        soft_start: each joint stays at zero until its reference first comes within 3 degrees after the actuators are
            switched on, at the controller's ``active_from`` (T 7.2.2).
    """

    _section = "gait"

    amplitude: float = _UNDULATION.amplitude
    omega: float = _UNDULATION.omega
    beta: float = _UNDULATION.beta
    gamma: float = _UNDULATION.gamma
    vertical_amplitude: float = _UNDULATION.vertical_amplitude
    vertical_omega: float = _UNDULATION.vertical_omega
    vertical_beta: float = _UNDULATION.vertical_beta
    vertical_phase: float = _UNDULATION.vertical_phase
    soft_start: bool = _UNDULATION.soft_start

    @classmethod
    def lateral_undulation(cls, **changes: Any) -> Gait:
        """Lateral undulation (T 7.3); keywords replace the thesis's values."""
        return cls(**changes)

    @classmethod
    def sidewinding(cls, **changes: Any) -> Gait:
        """Sidewinding (T 7.5): the vertical wave has the rate and phase shift of the horizontal one."""
        values = {"amplitude": 30 * DEGREE, "vertical_amplitude": 10 * DEGREE} | changes
        return cls._with_vertical(values)

    @classmethod
    def lateral_rolling(cls, **changes: Any) -> Gait:
        """U-shaped lateral rolling (T 7.4): both waves alike, a quarter period apart."""
        values = {"amplitude": 10 * DEGREE, "beta": 0.0} | changes
        values.setdefault("vertical_amplitude", values["amplitude"])
        return cls._with_vertical(values)

    @classmethod
    def sinus_lifting(cls, **changes: Any) -> Gait:
        """Lateral undulation that lifts the crests of its curve, where a link would slide sideways. It is faster on
        ground with more friction across the links than along them.

        The vertical wave has twice the rate and phase shift of the horizontal one and is highest where that bends most.
        Half a degree suffices, since the joints are stiff.
        """
        values = {"vertical_amplitude": 0.5 * DEGREE} | changes
        values.setdefault("vertical_omega", 2 * values.get("omega", cls.omega))
        values.setdefault("vertical_beta", 2 * values.get("beta", cls.beta))
        values.setdefault("vertical_phase", -90 * DEGREE)
        return cls(**values)

    @classmethod
    def caterpillar(cls, **changes: Any) -> Gait:
        """A vertical wave that travels along a robot straight seen from above, and takes it along."""
        values = {"amplitude": 0.0, "vertical_amplitude": 10 * DEGREE, "vertical_phase": 0.0} | changes
        return cls._with_vertical(values)

    def reference(
        self, time: ArrayLike, joints: int = 10, vertical: bool = False, start_up: float = 0.0
    ) -> dict[str, NDArray[np.float64]]:
        """The horizontal or vertical references at given times: "angle", "rate", "acceleration", (T, joints) each.

        ``start_up`` is when the actuators are switched on [s]; a soft start counts from then.

        Raises:
            ConfigError: names the argument that is not admissible.
        """
        times = _checks.times(time)
        joints = _checks.integer("joints", joints, 0, MOST_JOINTS)
        is_vertical = _checks.choice("vertical", vertical, [False, True])
        return gait_reference(self, joints, times, bool(is_vertical), _checks.number("gait.start_up", start_up))

    @classmethod
    def _with_vertical(cls, values: dict[str, Any]) -> Gait:
        values.setdefault("vertical_omega", values.get("omega", cls.omega))
        values.setdefault("vertical_beta", values.get("beta", cls.beta))
        values.setdefault("vertical_phase", 90 * DEGREE)
        return cls(**values)
