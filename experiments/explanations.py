"""The table of docs/robot.md on what explains how Aiko moved (T 7.5): friction, motors and joints, one at a time.

    python -m experiments.explanations

Speeds of link 6 over the second period of the gait (7.3) in the planar model, on open ground (T 7.5.2) and on the
course of Table 7.5 (T 7.5.3). Distance covered by link 6 in 15 s of sidewinding in 3D, and turn of the body to the
right from 6 s on (T 7.5.1). One table of Markdown; a minute.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import tyro

import snake_env
from snake_env import PD, Gait, Motor, Robot, Scene, Start
from snake_env.markdown import table
from snake_env.reproduce.experiment import PERIOD
from snake_env.reproduce.measures import at, heading, period_speed

HEAD = ("changed", "open ground", "course", "sidewinding", "turn to the right")
SIDEWINDING, SETTLED = 15.0, 6.0
"""Its duration, and when turning begins to count [s]."""
WEAK = Motor(stall_torque=1.5, no_load_speed=2.4)
"""0.9 W, where :meth:`Motor.aiko` has 6 W."""

CHANGES: dict[str, dict[str, Any]] = {
    "nothing, T Table 7.1": {},
    "friction 0.1": {"friction": (0.1, 0.1)},
    "friction 0.4": {"friction": (0.4, 0.4)},
    "5 % more friction across": {"friction": (0.2, 0.21)},
    "5 % more friction along": {"friction": (0.21, 0.2)},
    "20 % more friction backward": {"friction": (0.2, 0.2), "backward": 0.24},
    "20 % less friction backward": {"friction": (0.2, 0.2), "backward": 0.16},
    "`Motor.aiko()`": {"robot": Robot(motor=Motor.aiko())},
    "a motor of 0.9 W": {"robot": Robot(motor=WEAK)},
    "backlash of 4 degrees": {"robot": Robot.aiko()},
    "k_P = 15 N m/rad": {"controller": PD(kp=15.0, kd=0.5)},
}


def rows() -> Iterator[tuple[str, ...]]:
    """Rows of the table."""
    for name, change in CHANGES.items():
        free, course, (distance, turn) = measured(**change)
        yield name, f"{100 * free:.1f} cm/s", f"{100 * course:.1f} cm/s", f"{distance:.2f} m", f"{turn:.0f} deg"


def measured(
    friction: tuple[float, float] = (0.2, 0.2),
    backward: float | None = None,
    robot: Robot | None = None,
    controller: PD | None = None,
) -> tuple[float, float, tuple[float, float]]:
    """Speeds on open ground and on the course [m/s], distance [m] and turn [deg] of sidewinding."""
    ground: dict[str, Any] = {"friction": friction, "friction_backward": backward}
    common: dict[str, Any] = {"robot": robot or Robot(), "controller": controller or PD()}
    free, course = (
        snake_env.simulate(
            scene=dataclasses.replace(Scene.preset(name), **ground), duration=2 * PERIOD, sample=0.05, **common
        )
        for name in ("free", "table-7.5")
    )
    winding = snake_env.simulate(
        "spatial",
        gait=Gait.sidewinding(soft_start=True),
        start=Start(posture="straight"),
        scene=Scene(**ground),
        duration=SIDEWINDING,
        sample=0.05,
        **common,
    )
    moved = np.linalg.norm((winding.position[-1, 5] - winding.position[0, 5])[:2])
    turned = heading(winding)[at(winding, SIDEWINDING)] - heading(winding)[at(winding, SETTLED)]
    return period_speed(free), period_speed(course), (float(moved), -math.degrees(turned))


def main(arguments: list[str] | None = None) -> int:
    """Prints the table."""
    tyro.cli(lambda: None, args=arguments, description=__doc__)
    print(table(HEAD, rows()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
