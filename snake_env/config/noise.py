"""Noise on measurements."""

from __future__ import annotations

from dataclasses import dataclass

from snake_env import _checks
from snake_env.config.section import DEGREE, Section, core_defaults

_NONE = core_defaults("noise")


@dataclass(frozen=True)
class Noise(Section):
    """Amplitudes of the uniform noise on what a controller measures (T 7.9)-(T 7.14); each measurement draws anew.

    Measurements are taken when the controller's ``treatment`` computes torques, for "implicit" every 2.5e-4 s as in the
    thesis.

    Args:
        position: N_p [m], >= 0; no controller uses the position.
        heading: N_theta [rad], >= 0.
        joint_angle: N_phi [rad], >= 0.
        velocity: N_v of O_2 [m/s], >= 0.
        yaw_rate: N_theta' [rad/s], >= 0.
        joint_rate: N_phi' [rad/s], >= 0.
    """

    _section = "noise"

    position: float = _NONE.position
    heading: float = _NONE.heading
    joint_angle: float = _NONE.joint_angle
    velocity: float = _NONE.velocity
    yaw_rate: float = _NONE.yaw_rate
    joint_rate: float = _NONE.joint_rate

    @classmethod
    def table_7_4(cls, row: str) -> Noise:
        """Row "b", "c" or "d" of (T Table 7.4): the noise of Fig. 7.11 (b), (c) and (d)."""
        rows = {"b": (0.1, 0.1, 0.1), "c": (10.0, 10.0, 0.1), "d": (10.0, 10.0, 1.0)}
        base, turn, joint = rows[_checks.choice("noise.table_7_4", row, list(rows))]
        return cls(base, turn * DEGREE, joint * DEGREE, base, turn * DEGREE, joint * DEGREE)
