"""The mechanism of obstacle aided locomotion (section 5.3): Gray's three links, and push-points off the centre line.

Three links form a C. Link 1 makes the angle alpha with link 2, link 3 the angle beta, and each touches a smooth peg at
its CG: the outer two from within the C, the middle one from outside. Equal torques tau bend both joints further. With
a = L / 2 from joint to peg, the moments about the joints give the outer pegs' forces N = tau / a (without inertia and
ground friction), across links 1 and 3, and the balance across link 2 gives the third. Along link 2 nothing balances
their sum N (sin(alpha) - sin(beta)): the robot glides forward, link 1 leading, if alpha > beta.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env.config import PD, Gait, Robot, Scene, Start
from snake_env.config.section import DEGREE
from snake_env.reproduce import placement
from snake_env.reproduce.experiment import PERIOD, Experiment
from snake_env.reproduce.measures import between
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]

TORQUE = 2.0
"""In both joints [N m]."""
BETA = 30
"""Angle between links 2 and 3 [deg]."""
ALPHAS = (10, 20, 30, 40, 50)
"""Angles between links 1 and 2 [deg]."""
OFFSETS = (0.05, 0.09, 0.11, 0.13, 0.15)
"""Least distances of pegs' centres from the centre line [m]; at the first one the body touches them on that line."""
ROBOT = Robot(links=3)
BEND_FURTHER = Gait(amplitude=0.0, gamma=-80 * DEGREE)
"""A reference that the joints never reach, so that their torques stay at the limit."""
CONSTANT_TORQUE = PD(kp=1e4, kd=0.01, torque_limit=TORQUE)
ARM = 0.5 * float(np.mean(ROBOT.length))
"""From joint to peg [m]."""


class Push(NamedTuple):
    """Mean over a time.

    Attributes:
        place: distance of the pushed links' CGs from the centre line y = 0, weighted by their forces [m].
        ahead: sum of the forces ahead [N].
        across: sum of the magnitudes of the forces across [N].
    """

    place: float
    ahead: float
    across: float


def experiments() -> dict[str, Experiment]:
    """The three links, and the gait (7.3) among pegs whose centres are ever farther from the centre line."""
    found = {}
    for alpha in ALPHAS:
        scene, start = three_links(alpha * DEGREE, BETA * DEGREE)
        found[f"three links {alpha}"] = Experiment(
            scene, 0.1, BEND_FURTHER, start, controller=CONSTANT_TORQUE, robot=ROBOT
        )
    for offset in OFFSETS:
        scene, start = placement.course(Gait(), off_centre=offset)
        found[f"pegs off {offset:g}"] = Experiment(scene, 2 * PERIOD, Gait(), start)
    return found


def three_links(alpha: float, beta: float, radius: float = placement.RADIUS) -> tuple[Scene, Start]:
    """Pegs at the CGs of three links with the angles alpha and beta [rad]; link 2 lies along x at the origin."""
    headings = np.array([alpha, 0.0, -beta])
    along = np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    centres = ARM * np.array([along[1] + along[0], np.zeros(2), -along[1] - along[2]])
    pegs = centres + (float(np.mean(ROBOT.radius)) + radius) * np.array([[1.0], [-1.0], [1.0]]) * across(headings)
    start = Start((float(centres[0, 0]), float(centres[0, 1])), math.pi + alpha, posture=[-alpha, -beta])
    return Scene(obstacles=[(radius, float(x), float(y)) for x, y in pegs]), start


def across(headings: Array) -> Array:
    """Unit vectors to the left of headings (n,) -> (n, 2)."""
    return np.stack([-np.sin(headings), np.cos(headings)], axis=-1)


def peg_forces(alpha: float, beta: float) -> Array:
    """Forces of the pegs on the three links by statics (3, 2) [N]."""
    outer = TORQUE / ARM
    middle = outer * (math.cos(alpha) + math.cos(beta))
    return np.array([[-outer], [middle], [-outer]]) * across(np.array([alpha, 0.0, -beta]))


def push(run: Trajectory, start: float, end: float) -> Push:
    """What the pegs do over a time."""
    times = between(run, start, end)
    force = run.contact_force[times]
    strength = np.linalg.norm(force, axis=-1)
    place = float((strength * np.abs(run.position[times, :, 1])).sum() / strength.sum())
    return Push(place, float(force[..., 0].sum(axis=1).mean()), float(np.abs(force[..., 1]).sum(axis=1).mean()))
