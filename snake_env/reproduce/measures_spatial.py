"""Numbers read off a trajectory of the spatial model."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env.config import Robot
from snake_env.reproduce.measures import MIDDLE, at
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]

CLOSE = 1e-3
"""Height of an end sphere above the ground below which it counts as touching [m]."""


def axes(run: Trajectory) -> tuple[Array, Array]:
    """e_y^B and e_z^B of every link in the inertial frame, (T, n, 3) each."""
    assert run.quaternion is not None, "a run of the spatial model"
    w, x, y, z = np.moveaxis(run.quaternion, -1, 0)
    e_y = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=-1)
    e_z = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)
    return e_y, e_z


def vertical_velocity(run: Trajectory, link: int) -> Array:
    """Mean velocity of a link's CG along z in each sample interval (T - 1,) [m/s]; links count from 0."""
    return np.diff(run.position[:, link, 2]) / np.diff(run.time)


def impact(run: Trajectory, link: int) -> int:
    """Index of the last sample interval in which a link falls freely."""
    return int(np.argmin(vertical_velocity(run, link)))


def turns(run: Trajectory, link: int = MIDDLE) -> float:
    """How often a lying link has turned about its centre line; positive about e_z^B."""
    e_y, e_z = axes(run)
    e_y, e_z = e_y[:, link], e_z[:, link]
    across = np.stack([-e_z[:, 1], e_z[:, 0]], axis=-1)
    angle = np.unwrap(np.arctan2(np.sum(e_y[:, :2] * across, axis=-1), e_y[:, 2]))
    return float(angle[0] - angle[-1]) / (2.0 * np.pi)


def displacement(run: Trajectory, start: float, end: float) -> Array:
    """How far link 6 has come over the ground (2,) [m]."""
    return run.position[at(run, end), MIDDLE, :2] - run.position[at(run, start), MIDDLE, :2]


def direction(way: Array) -> float:
    """Direction of a displacement from the x axis [deg]."""
    return float(np.degrees(np.arctan2(way[1], way[0])))


def edge(run: Trajectory) -> Array:
    """At the start, from the middle of the robot's ends to link 6: the way to the closed side of its U (2,) [m]."""
    first, last = run.position[0, 0, :2], run.position[0, -1, :2]
    return run.position[0, MIDDLE, :2] - 0.5 * (first + last)


def angle_between(a: Array, b: Array) -> float:
    """From ``a`` to ``b``, positive anticlockwise [deg]."""
    return float(np.degrees(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)))


def body_turn(run: Trajectory, start: float, end: float) -> float:
    """How far the line from the last to the first link turns to the left [deg]."""
    before, after = (run.position[at(run, time), 0, :2] - run.position[at(run, time), -1, :2] for time in (start, end))
    return angle_between(before, after)


def sway(run: Trajectory) -> float:
    """Farthest that link 6 gets from the straight line between its first and last place, over that line's length."""
    path = run.position[:, MIDDLE, :2] - run.position[0, MIDDLE, :2]
    way = path[-1]
    off = (path[:, 0] * way[1] - path[:, 1] * way[0]) / np.linalg.norm(way)
    return float(np.abs(off).max() / np.linalg.norm(way))


class SlideBack(NamedTuple):
    """A time during which a robot that moves along the y axis moves against it [s], and how far [m]."""

    begin: float
    end: float
    distance: float


def slide_backs(run: Trajectory, start: float, least: float = 0.01) -> list[SlideBack]:
    """Where link 6 moves against the y axis after ``start`` [s] by at least ``least`` [m]."""
    time, y = run.time[run.time >= start], run.position[run.time >= start, MIDDLE, 1]
    turning = np.flatnonzero(np.diff(np.sign(np.diff(y)))) + 1
    ends = np.concatenate([[0], turning, [len(y) - 1]])
    found = [SlideBack(time[i], time[j], y[i] - y[j]) for i, j in pairwise(ends)]
    return [slide for slide in found if slide.distance >= least]


def lateral_distance(one: Array, other: Array) -> float:
    """Largest distance across the track between two paths (T, 2 or 3) along +x over the part that both pass [m]."""
    x = np.linspace(max(one[0, 0], other[0, 0]) + 0.1, min(one[-1, 0], other[-1, 0]) - 0.1, 500)
    order = [np.argsort(path[:, 0]) for path in (one, other)]
    y = [np.interp(x, path[k, 0], path[k, 1]) for path, k in zip((one, other), order, strict=True)]
    return float(np.abs(y[0] - y[1]).max())


def touching_share(run: Trajectory, robot: Robot, start: float) -> float:
    """Mean share of the end spheres that touch the ground after ``start`` [s]."""
    _, e_z = axes(run)
    lift = np.asarray(robot.contact_half_length) * e_z[..., 2]
    height = run.position[..., 2] - np.asarray(robot.radius)
    ends = np.stack([height + lift, height - lift])[:, run.time >= start]
    return float((ends < CLOSE).mean())
