"""Pegs for a given gait by the rule of sections 5.5 and 7.3.4.

"Curve the snake robot to the initial shape of this gait and place obstacles along the snake robot", one for
each place where its path crosses the centre line, "close to the centre line of the sinus-like shape":

1. A peg belongs on the flank that follows a bend, on the bend's inner side: Obstacle 1 of Fig. 5.2 and
   5.3 (b), whose push on the body points forward. On the flank before the bend it would push backward.
2. Its centre lies as close to the centre line as the body leaves room while it moves along its natural path,
   keeping a clearance; and there as far forward as it fits.
3. The pattern repeats half a wave later on the other side of the centre line, from the tail on.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snake_env.config import Gait, Robot, Scene, Start
from snake_env.reproduce.serpenoid import NaturalPath

Array = NDArray[np.float64]

RADIUS = 0.02
"""Peg radius [m], the middle one of Table 7.3."""
CLEARANCE = 0.001
"""Smallest gap of body and peg on the natural path [m]."""
AHEAD = 2.5
"""Length of the course in front of link 1 [m]."""
GRID = 0.001
"""Step of the search for a peg's place [m]."""


def course(
    gait: Gait,
    robot: Robot | None = None,
    radius: float = RADIUS,
    clearance: float = CLEARANCE,
    off_centre: float = 0.0,
) -> tuple[Scene, Start]:
    """The scene whose pegs are placed for ``gait``, and the start in its posture, CG of link 1 at x = 0.

    ``off_centre`` is the least distance of a peg's centre from the centre line, to the bend's inner side [m].
    """
    robot = Robot() if robot is None else robot
    path = NaturalPath(gait, float(np.mean(robot.length)))
    x, y = peg_offset(path, robot, radius, clearance, off_centre)
    pegs = []
    first = math.ceil((path.beta * (robot.links - 1) - path.crossing) / math.pi)
    last = math.floor((AHEAD / path.advance_per_phase - path.crossing) / math.pi)
    for bend in range(first, last + 1):
        crossing = path.position(path.crossing + bend * math.pi)
        side = 1.0 if bend % 2 == 0 else -1.0
        pegs.append((radius, float(crossing[0]) + x, side * y))
    position = path.position(0.0)
    start = Start((float(position[0]), float(position[1])), math.pi + float(path.direction(0.0)))
    return Scene(obstacles=pegs), start


def peg_offset(
    path: NaturalPath, robot: Robot, radius: float, clearance: float, off_centre: float = 0.0
) -> tuple[float, float]:
    """Centre of the peg of an upward crossing, relative to the crossing [m].

    x runs from the crossing (0) back to the bend before it (a quarter wave), y from the centre line to the
    bend's inner side.
    """
    crossing = path.position(path.crossing)
    x = -np.arange(0.0, 0.5 * path.half_wave, GRID)
    for y in np.arange(off_centre, path.half_wave, GRID):
        places = np.stack([crossing[0] + x, np.full_like(x, y)], axis=-1)
        fits = swept_distance(path, robot, places) >= radius + clearance
        if fits.any():
            return float(x[np.argmax(fits)]), float(y)
    raise ValueError(f"radius = {radius}: expected a peg that fits into the bends of this gait")


def swept_distance(path: NaturalPath, robot: Robot, points: Array) -> Array:
    """Distance (m,) from points (m, 2) to the ground that the links sweep on their path [m]; negative inside.

    The path is followed over the wave around the bend before an upward crossing. A link is a segment of half
    length L_GS along its direction, thickened by L_SC.
    """
    phase = path.crossing + np.linspace(-1.5 * math.pi, 0.5 * math.pi, 400)
    direction = path.direction(phase)
    along = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    offset = points[:, None, :] - path.position(phase)
    half_length = float(np.max(robot.contact_half_length))
    nearest = np.clip(np.sum(offset * along, axis=-1), -half_length, half_length)
    distance = np.linalg.norm(offset - nearest[..., None] * along, axis=-1)
    return distance.min(axis=-1) - float(np.max(robot.radius))
