"""What the viewer shows: poses and forces of one robot at a row of times, and the scene around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from snake_env.config import Scene
from snake_env.config.robot import per_link
from snake_env.state import State, centre_line
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]


NOTHING: Array = np.empty((0, 0, 2))
"""Positions where nothing can be pushed."""


@dataclass(frozen=True)
class Frames:
    """T poses of L links in 3D; a planar robot lies on the ground.

    Attributes:
        time: (T,) [s].
        position: (T, L, 3) middles of the links [m].
        quaternion: (T, L, 4) w first, from a frame whose z axis is the centre line of a link.
        force: (T, L, 3) of the obstacles on each link [N].
        joint_angle: (T, joints) [rad], yaw angles before pitch angles in 3D.
        joint_torque: (T, joints) [N m].
        half_length: (L,) of the straight sides of a link [m].
        radius: (L,) of a link [m].
        scene: obstacles and ground.
        obstacle_position: (T, k, 2) of the obstacles that can be pushed [m].
        obstacle_angle: (T, k) by how much they have turned about the vertical [rad].
        obstacle_height: (T, k) of the centres of spheres [m]; (0, 0) without any in a run.
        goal: x, y of its centre [m]; None without a goal.
        goal_radius: of the goal disc [m].
        back: (3,) unit vector from the centre line of a link to its back, in its frame.
    """

    time: Array
    position: Array
    quaternion: Array
    force: Array
    joint_angle: Array
    joint_torque: Array
    half_length: Array
    radius: Array
    scene: Scene = field(default_factory=Scene)
    obstacle_position: Array = field(default_factory=lambda: NOTHING)
    obstacle_angle: Array = field(default_factory=lambda: NOTHING[..., 0])
    obstacle_height: Array = field(default_factory=lambda: NOTHING[..., 0])
    goal: Array | None = None
    goal_radius: float = 0.0
    back: tuple[float, float, float] = (0.0, 1.0, 0.0)

    @classmethod
    def of_trajectory(cls, trajectory: Trajectory) -> Frames:
        """The samples of a scripted run."""
        robot = trajectory.robot
        radius, offset = (per_link(value, robot.links) for value in (robot.radius, robot.cg_offset))
        turn = _orientation(trajectory.angle, trajectory.quaternion)
        return cls(
            trajectory.time,
            _raised(trajectory.position, radius) + offset[:, np.newaxis] * centre_line(turn),
            turn,
            _spatial(trajectory.contact_force),
            _flat(trajectory.joint_angle),
            _flat(trajectory.joint_torque),
            per_link(robot.contact_half_length, robot.links),
            radius,
            trajectory.scene,
            NOTHING if trajectory.obstacle_position is None else trajectory.obstacle_position,
            NOTHING[..., 0] if trajectory.obstacle_angle is None else trajectory.obstacle_angle,
            NOTHING[..., 0] if trajectory.obstacle_height is None else trajectory.obstacle_height,
            back=BACK[trajectory.quaternion is not None],
        )

    @classmethod
    def of_states(cls, states: Sequence[State], scene: Scene) -> Frames:
        """The states of one robot at control instants, as of ``env.unwrapped.state()`` of a single environment."""
        first = states[0]
        stack = {name: np.stack([getattr(state, name) for state in states]) for name in SHOWN}
        three = first.link_quaternion is not None
        angle = None if three else np.stack([np.asarray(state.link_angle) for state in states])
        quaternion = np.stack([np.asarray(state.link_quaternion) for state in states]) if three else None
        turn = _orientation(angle, quaternion)
        return cls(
            stack["time"],
            _raised(stack["link_position"], first.link_radius)
            + first.link_cg_offset[:, np.newaxis] * centre_line(turn),
            turn,
            _spatial(stack["contact_force"]),
            _flat(stack["joint_angle"]),
            _flat(stack["joint_torque"]),
            first.link_half_length,
            first.link_radius,
            scene,
            stack["obstacle_position"],
            stack["obstacle_angle"],
            stack["obstacle_height"],
            np.asarray(first.goal, float),
            float(first.goal_radius),
            BACK[three],
        )

    def every(self, step: int) -> Frames:
        """Each ``step``-th pose."""
        moving = ("time", "position", "quaternion", "force", *SHOWN[3:])
        return replace(self, **{name: getattr(self, name)[::step] for name in moving})

    def __len__(self) -> int:
        return len(self.time)


BACK = {False: (-1.0, 0.0, 0.0), True: (0.0, 1.0, 0.0)}
"""In the frames of links in the plane and in 3D, where it is the axis of yaw."""
SHOWN = (
    "time",
    "link_position",
    "contact_force",
    "joint_angle",
    "joint_torque",
    "obstacle_position",
    "obstacle_angle",
    "obstacle_height",
)


def _flat(joints: Array) -> Array:
    """Angles or torques (T, joints); of cardan joints (T, n, 2) all yaws, then all pitches."""
    return joints if joints.ndim == 2 else np.concatenate([joints[..., 0], joints[..., 1]], axis=1)


def _spatial(vectors: Array) -> Array:
    """Vectors (..., 3), without a vertical component in the plane."""
    return vectors if vectors.shape[-1] == 3 else np.concatenate([vectors, np.zeros_like(vectors[..., :1])], axis=-1)


def _raised(position: Array, radius: Array) -> Array:
    """Positions (T, L, 3): a planar robot lies on the ground."""
    found = np.array(_spatial(position))
    if position.shape[-1] == 2:
        found[..., 2] = radius
    return found


def _orientation(angle: Array | None, quaternion: Array | None) -> Array:
    """Quaternions (T, L, 4) that turn z into the centre line: in the plane from z to x, then by the link's angle."""
    if quaternion is not None:
        return quaternion
    assert angle is not None
    half, root = 0.5 * angle, np.sqrt(0.5)
    cos, sin = np.cos(half), np.sin(half)
    return root * np.stack([cos, -sin, cos, sin], axis=-1)
