"""Compliant ground (T 2.3), a spring and a damper under a link that falls on it, against the set-valued contact."""

from __future__ import annotations

import math

import numpy as np

from snake_env.config import Gait, Robot, Scene, Start
from snake_env.reproduce.experiment import AIKO, DEFAULT, Experiment

HEIGHT = 0.3
"""Of the fall, as in section 7.3.1 [m]."""
STIFFNESS = (1e4, 1e5, 1e6, 1e7)
"""k of (T 2.3) [N/m]; its damping is critical, d = 2 sqrt(k m)."""
RUNGE_KUTTA = 2.785
"""The classical method is stable up to this, divided by sqrt(k / m)."""
MASS = float(np.mean(AIKO.mass))
DURATION = 1.0
"""From the start of the fall [s]."""
LOST = 1.0
"""Depth or height that no integration reaches which is stable [m]."""


def experiments() -> dict[str, Experiment]:
    """Two links of Aiko that fall flat, with set-valued contact at the default step, whatever the method of the runs: a
    side of a comparison.
    """
    start = Start(position=(0.0, 0.0, float(np.mean(AIKO.radius)) + HEIGHT), posture="straight")
    drop = Experiment(
        Scene(),
        DURATION,
        Gait(amplitude=0.0),
        start,
        "spatial",
        robot=Robot(links=2),
        integrator=DEFAULT,
        printed=DEFAULT,
    )
    return {"flat drop": drop}


def depths(stiffness: float, step: float) -> tuple[float, float]:
    """Deepest and last penetration of a link [m], infinite if the integration is unstable."""
    damping = 2.0 * math.sqrt(stiffness * MASS)
    z, speed, deepest = HEIGHT, 0.0, 0.0
    for _ in range(round(DURATION / step)):
        z, speed = _runge_kutta(z, speed, stiffness, damping, step)
        deepest = max(deepest, -z)
        if abs(z) > LOST:
            return math.inf, math.inf
    return deepest, -z


def _runge_kutta(z: float, speed: float, stiffness: float, damping: float, step: float) -> tuple[float, float]:
    """One step of the classical method."""

    def rate(z: float, speed: float) -> tuple[float, float]:
        force = -stiffness * z - damping * speed if z < 0.0 else 0.0
        return speed, force / MASS - AIKO.gravity

    one = rate(z, speed)
    two = rate(z + 0.5 * step * one[0], speed + 0.5 * step * one[1])
    three = rate(z + 0.5 * step * two[0], speed + 0.5 * step * two[1])
    four = rate(z + step * three[0], speed + step * three[1])
    sums = [(a + 2.0 * b + 2.0 * c + d) / 6.0 for a, b, c, d in zip(one, two, three, four, strict=True)]
    return z + step * sums[0], speed + step * sums[1]


def largest_step(stiffness: float) -> float:
    """Up to which the link comes to rest at m g / k, within 5 % [s]."""
    theory = RUNGE_KUTTA / math.sqrt(stiffness / MASS)
    low, high = 0.25 * theory, 4.0 * theory
    while high / low > 1.02:
        middle = math.sqrt(low * high)
        settled = abs(depths(stiffness, middle)[1] * stiffness / (MASS * AIKO.gravity) - 1.0) < 0.05
        low, high = (middle, high) if settled else (low, middle)
    return low
