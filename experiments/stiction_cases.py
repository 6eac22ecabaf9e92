"""What friction must hold: robots on slopes and between walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from snake_env import PD, Gait, Robot, Scene, Start
from snake_env.config.robot import per_link
from snake_env.obstacles import Segment

MU, WALL_MU = 0.3, 0.7
SERVO = PD(torque_limit=10.0)


@dataclass(frozen=True)
class Case:
    """A robot, where it lies, and what its joints are told."""

    scene: Scene
    start: Start
    robot: Robot
    target: Gait


def straight(share: float) -> Case:
    """The straight robot along a slope of ``share`` of the critical one."""
    return Case(sloped(share), Start(heading=0.0, posture="straight"), Robot(), Gait(amplitude=0.0))


def resting() -> Case:
    """The robot in the posture of the gait, which its servos hold, on half the critical slope."""
    return Case(sloped(0.5), Start(heading=0.0), Robot(), Gait(omega=0.0))


def sloped(share: float) -> Scene:
    """Ground without rolling friction; coordinates are the ground's."""
    return Scene(friction=(MU, MU), rolling_friction=0.0, slope=(float(np.arctan(share * MU)), 0.0))


def braced(bend: float = 0.5, play: float = 1e-3) -> Case:
    """Two links in a V between walls along which gravity acts, held by the torque that bends them further."""
    robot = Robot(links=2)
    length, half, radius = (per_link(value, 1)[0] for value in (robot.length, robot.contact_half_length, robot.radius))
    length *= 0.5
    width = 2.0 * (half * np.sin(bend) + radius) + play
    apex = width - radius - 0.5 * play + (length - half) * np.sin(bend)
    position = (-length * float(np.cos(bend)), float(apex - length * np.sin(bend)))
    walls = [Segment((-1.0, y), (1.0, y), friction=WALL_MU) for y in (0.0, float(width))]
    scene = Scene(obstacles=walls, friction=(0.0, 0.0), rolling_friction=0.0, slope=(0.5 * np.pi, 0.0))
    start = Start(position=position, heading=bend, posture=[-2.0 * bend])
    return Case(scene, start, robot, Gait(amplitude=0.0, gamma=-3.0 * bend))
