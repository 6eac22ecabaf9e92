"""The table of docs/robot.md on backlash and Stribeck friction: speed, joint errors and torques.

    python -m experiments.discrepancies

The thesis's robot under its gait (7.3), planar model, from 2 s to 6.5 s, one period of the gait: mean forward speed of
the CG on the course of Table 7.5 and on open orthotropic ground; and on the course the joints' distances from their
references and the motors' torques. One table of Markdown; some seconds.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Iterator
from itertools import product

import numpy as np
import tyro
from numpy.typing import NDArray

import snake_env
from snake_env import Gait, Robot, Scene, Stribeck, Trajectory
from snake_env.markdown import table

SETTLED, DURATION, SAMPLE = 2.0, 6.5, 0.02
COURSE, OPEN = Scene.preset("table-7.5"), Scene.preset("free", friction=(0.2, 0.5))
PLAY = (0.0, 3.0, 5.0)
"""Degrees."""
EFFECTS = {
    "none": Stribeck(),
    "30 %, half at 2 cm/s": Stribeck(drop=0.3, speed=0.02),
    "30 %, half at 10 cm/s": Stribeck(drop=0.3, speed=0.1),
}

HEAD = (
    "backlash",
    "friction lost in sliding",
    "speed on the course",
    "on open ground",
    "joint error, RMS (largest)",
    "torque, RMS (largest)",
)


def rows() -> Iterator[tuple[str, ...]]:
    """Rows of the table."""
    for (name, effect), play in product(EFFECTS.items(), PLAY):
        robot = Robot(backlash=math.radians(play))
        course, free = (run(robot, dataclasses.replace(scene, stribeck=effect)) for scene in (COURSE, OPEN))
        settled = course.time >= SETTLED - 0.5 * SAMPLE
        error = np.degrees(course.joint_angle - Gait().reference(course.time)["angle"])[settled]
        speeds = f"{100 * speed(course):.2f} cm/s", f"{100 * speed(free):.2f} cm/s"
        torque = course.joint_torque[settled]
        yield f"{play:g} deg", name, *speeds, f"{summary(error)} deg", f"{summary(torque)} N m"


def run(robot: Robot, scene: Scene) -> Trajectory:
    """The gait of the thesis from the thesis's start."""
    return snake_env.simulate(robot=robot, scene=scene, duration=DURATION, sample=SAMPLE)


def speed(trajectory: Trajectory) -> float:
    """Mean forward speed of the CG once the start is over [m/s]."""
    first = int(np.searchsorted(trajectory.time, SETTLED - 0.5 * SAMPLE))
    moved = trajectory.position[-1].mean(axis=0) - trajectory.position[first].mean(axis=0)
    return float(moved[0] / (trajectory.time[-1] - trajectory.time[first]))


def summary(values: NDArray[np.float64]) -> str:
    """Root mean square, and the largest."""
    return f"{math.sqrt((values**2).mean()):.2g} ({abs(values).max():.2g})"


def main(arguments: list[str] | None = None) -> int:
    """Prints the table."""
    tyro.cli(lambda: None, args=arguments, description=__doc__)
    print(table(HEAD, rows()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
