"""Robots with one broken joint (T ch. 8): locked at the angle of the start, or limp."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from snake_env.config import PD, Robot
from snake_env.reproduce.experiment import DEFAULT, PERIOD, Experiment, Runs
from snake_env.reproduce.measures import mean_velocity

JOINTS = range(10)
"""Of Aiko, from 0."""
SCENES = ("table 7.5", "orthotropic")
MOTORS = PD(torque_limit=10.0)
"""Over twice the largest torque of the whole robot on the course: without a limit a robot that a locked joint jams
between pegs is shot out at several m/s."""


def experiments(whole: Mapping[str, Experiment]) -> dict[str, Experiment]:
    """The course of Table 7.5 and free orthotropic ground, with the whole robot and with one joint after the other
    broken; the printed scheme has no broken joints.
    """
    found = {}
    for scene in SCENES:
        robots = {"whole": Robot()} | {f"locked {j}": Robot(locked=(j,)) for j in JOINTS}
        robots |= {f"limp {j}": Robot(limp=(j,)) for j in JOINTS}
        for name, robot in robots.items():
            found[f"broken: {scene}, {name}"] = dataclasses.replace(
                whole[scene], robot=robot, controller=MOTORS, integrator=DEFAULT, printed=DEFAULT
            )
    return found


def remaining(runs: Runs, scene: str, way: str) -> list[float]:
    """Way along x in two periods over that of the whole robot, joint by joint."""
    ahead = [
        float(mean_velocity(runs[f"broken: {scene}, {name}"], 0.0, 2 * PERIOD)[0])
        for name in ("whole", *(f"{way} {joint}" for joint in JOINTS))
    ]
    return [speed / ahead[0] for speed in ahead[1:]]
