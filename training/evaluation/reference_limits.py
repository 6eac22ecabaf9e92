"""What no policy can beat: costs of transport by length of path, and the speed of a wave that does not slip."""

from __future__ import annotations

import numpy as np

from snake_env import Robot, Scene
from snake_env.policies.gaits import DEGREE, GaitParameters


def swing(gait: GaitParameters) -> float:
    """Largest angle K between body and direction of travel [rad], A / (2 sin(|beta| / 2))."""
    return gait.amplitude / (2.0 * np.sin(0.5 * abs(gait.beta)))


def straightness(gait: GaitParameters) -> float:
    """Way made over length of path of a body that follows the wave's curve: the mean of cos(K cos x), J_0(K).

    The mean over equidistant phases converges faster than any power of their number.
    """
    phases = np.arange(256) * (2.0 * np.pi / 256)
    return float(np.cos(swing(gait) * np.cos(phases)).mean())


def no_slip_speed(gait: GaitParameters) -> float:
    """Speed of Aiko in a wave whose links move along themselves [m/s]: one link length in the time of a phase shift."""
    return float(np.mean(Robot().length)) * gait.omega / abs(gait.beta) * straightness(gait)


def follow_the_leader_cost(mu: float) -> float:
    """Cost of transport of a body on the curve of the thesis's gait without slip: mu times path over progress."""
    return mu / straightness(GaitParameters())


def weaving(scene: Scene | None = None, half_width: float | None = None) -> float:
    """Least path length over progress of anything that passes successive pegs on alternating sides.

    Between two pegs whose centres are D apart and alpha off the direction of travel, a taut string at the distance rho
    from both runs straight for sqrt(D^2 - 4 rho^2) and along each for rho theta, theta = asin(2 rho / D) - alpha.

    Args:
        scene: pegs of one radius in the order in which they are passed; None: the course of Table 7.5.
        half_width: of the robot [m]; None: Aiko's.
    """
    radius, x, y = np.array((scene or Scene.preset("table-7.5")).obstacles).T
    rho = radius[0] + float(np.max(Robot().radius if half_width is None else half_width))
    along, across = np.diff(x), np.abs(np.diff(y))
    apart = np.hypot(along, across)
    theta = np.arcsin(2.0 * rho / apart) - np.arctan2(across, along)
    return float((np.sqrt(apart**2 - 4.0 * rho**2) + 2.0 * rho * theta).sum() / along.sum())


FASTEST_WAVE = GaitParameters(amplitude=15 * DEGREE, omega=200 * DEGREE, beta=-25 * DEGREE)
"""Of all waves that actions can command, the one of the largest speed without slip."""
