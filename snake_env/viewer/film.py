"""Films of scripted runs, drawn as the environments draw theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from snake_env._views import Views
from snake_env.config.robot import per_link
from snake_env.evaluation.film import write
from snake_env.picture import LAYERS, Picture
from snake_env.rewards import TERMS
from snake_env.state import State
from snake_env.trajectory import Trajectory

FAR = 1e3
"""Where goal and corridor are drawn that a scripted run does not have [m]."""


def film(trajectory: Trajectory, path: Path) -> Path:
    """Writes an mp4 file in real time, or a gif where no ffmpeg is found; returns what was written."""
    picture = Picture(layers=tuple(layer for layer in LAYERS if layer != "goal"))
    views = Views(picture)
    pictures = [views.image(0, _state(trajectory, k), trajectory.scene) for k in range(len(trajectory.time))]
    step = float(np.median(np.diff(trajectory.time))) if len(trajectory.time) > 1 else 1.0
    return write(pictures, path, frames_per_second=max(1, round(1.0 / step)))


def _state(trajectory: Trajectory, k: int) -> State:
    """One sample as the state of a robot without a goal; velocities, which no picture shows, are zero."""
    robot, position = trajectory.robot, trajectory.position[k]
    links = robot.links
    centre, zeros = position[:, :2].mean(axis=0), np.zeros_like(position)
    three: dict[str, Any] = {}
    if trajectory.quaternion is not None:
        three = {"link_quaternion": trajectory.quaternion[k], "normal_force": np.zeros(links)}
    else:
        three = {"link_angle": trajectory.angle[k]}
    return State(
        time=trajectory.time[k],
        position=centre,
        velocity=np.zeros(2),
        heading=np.float64(0.0),
        energy=trajectory.energy[k],
        distance=np.float64(centre[0] - trajectory.position[0, :, 0].mean()),
        goal=np.array([FAR, 0.0]),
        goal_radius=np.float64(0.0),
        goal_direction=np.float64(0.0),
        goal_speed=np.float64(0.0),
        corridor_half_width=np.float64(FAR),
        link_position=position,
        link_velocity=zeros,
        link_angular_velocity=np.zeros(links) if trajectory.quaternion is None else zeros,
        joint_angle=trajectory.joint_angle[k],
        joint_rate=np.zeros_like(trajectory.joint_angle[k]),
        joint_torque=trajectory.joint_torque[k],
        contact_force=trajectory.contact_force[k],
        self_contact_force=zeros,
        reward_terms=np.zeros(len(TERMS)),
        obstacles=np.empty((0, 3)),
        obstacle_position=np.empty((0, 2)) if trajectory.obstacle_position is None else trajectory.obstacle_position[k],
        obstacle_angle=np.empty(0) if trajectory.obstacle_angle is None else trajectory.obstacle_angle[k],
        obstacle_height=np.empty(0) if trajectory.obstacle_height is None else trajectory.obstacle_height[k],
        obstacle_force=np.empty((0, 2)),
        path=np.empty((0, 2)),
        link_half_length=per_link(robot.contact_half_length, links),
        link_radius=per_link(robot.radius, links),
        link_cg_offset=per_link(robot.cg_offset, links),
        **three,
    )
