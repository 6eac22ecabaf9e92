"""Sidewinding up a flight of stairs (T ch. 8)."""

from __future__ import annotations

import numpy as np

from snake_env.config import Gait, Scene, Start
from snake_env.config.section import DEGREE
from snake_env.obstacles import Box
from snake_env.reproduce.experiment import DEFAULT, Experiment, Runs

STEPS = 3
TREAD = 0.8
"""Depth of a step [m]."""
FOOT = 0.6
"""Distance of the first step from the robot's start [m]."""
LANDING = 4.0
"""Depth of the landing beyond the last step [m]."""
WIDTH = 10.0
"""Of the stairs [m]."""
DURATION = 60.0
CASES = ((10, 1, 0.2), (10, 2, 0.2), (20, 2, 0.2))
"""Vertical amplitude [deg], rise of a step [cm], friction coefficient."""
HIGH = (20, 6)
"""Vertical amplitude [deg] and rise [cm] of steps that are played with many coefficients of friction, since the outcome
changes with the least of them: whether a link catches an edge depends on its place within a millimetre."""
FRICTION = tuple(round(0.18 + 0.005 * k, 3) for k in range(9))
TWICE_THE_FRICTION = tuple(2.0 * mu for mu in FRICTION)


def flight(rise: float) -> list[Box]:
    """Steps across the y axis, which rise by ``rise`` [m] each; boxes that overlap."""
    end = FOOT + STEPS * TREAD + LANDING
    starts = [FOOT + k * TREAD for k in range(STEPS)]
    return [
        Box((WIDTH, end - start), 0.0, 0.5 * (start + end), height=(k + 1) * rise) for k, start in enumerate(starts)
    ]


def experiment_name(lift: int, rise: int, mu: float) -> str:
    """Of the experiment of one case."""
    return f"stairs: A_v {lift}, {rise} cm, mu {mu:g}"


def experiments() -> dict[str, Experiment]:
    """Every case; the printed scheme has no obstacles of finite height."""
    return {
        experiment_name(lift, rise, mu): Experiment(
            Scene(obstacles=flight(0.01 * rise), friction=(mu, mu)),
            DURATION,
            Gait.sidewinding(soft_start=True, vertical_amplitude=lift * DEGREE),
            Start(posture="straight"),
            "spatial",
            sample=0.5,
            integrator=DEFAULT,
            printed=DEFAULT,
        )
        for lift, rise, mu in (*CASES, *((*HIGH, mu) for mu in FRICTION + TWICE_THE_FRICTION))
    }


def climbed(runs: Runs, lift: int, rise: int, mu: float) -> float:
    """Height of the lowest link at the end over that at the start, in steps."""
    height = runs[experiment_name(lift, rise, mu)].position[:, :, 2]
    return float(np.min(height[-1]) - np.min(height[0])) / (0.01 * rise)
