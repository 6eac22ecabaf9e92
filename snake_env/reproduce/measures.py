"""Numbers read off a trajectory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env.reproduce.experiment import PERIOD
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]

MIDDLE = 5
"""Index of link 6, which the thesis follows."""
TOUCH = 0.3
"""Mean force above which a link counts as pushed [N]."""
SPIKE = 4.0
"""Force of a spike, over the median force of a pushed link."""
AFTER_COLLISION = 0.02
"""Time in which a collision ends [s]."""


def between(run: Trajectory, start: float, end: float) -> slice:
    """The samples with start < t <= end, whose forces are means over that time."""
    first, last = np.searchsorted(run.time, [start, end], side="right")
    return slice(int(first), int(last))


def at(run: Trajectory, time: float) -> int:
    """Index of the sample nearest to ``time`` [s]."""
    return int(np.argmin(np.abs(run.time - time)))


def gravity_centre(run: Trajectory) -> Array:
    """CG of the robot (T, 2) [m]; its links weigh the same."""
    return run.position.mean(axis=1)


def mean_velocity(run: Trajectory, start: float, end: float) -> Array:
    """Displacement of link 6 over time (2,) [m/s]."""
    first, last = at(run, start), at(run, end)
    return (run.position[last, MIDDLE] - run.position[first, MIDDLE]) / (run.time[last] - run.time[first])


def period_speed(run: Trajectory) -> float:
    """Forward speed of link 6 over the second period of the gait, when the start is forgotten [m/s]."""
    return float(mean_velocity(run, PERIOD, 2 * PERIOD)[0])


def heading(run: Trajectory) -> Array:
    """Mean direction of the body (T,) [rad]: links point to the tail, so it is opposite to their mean."""
    return np.unwrap(np.arctan2(-np.sin(run.angle).mean(axis=1), -np.cos(run.angle).mean(axis=1)))


def mean_force(run: Trajectory, start: float, end: float) -> Array:
    """Force of the pegs on each link, averaged over a time (n, 2) [N]."""
    return run.contact_force[between(run, start, end)].mean(axis=0)


def pushed_links(force: Array) -> list[int]:
    """Numbers of the links that are pushed, 1-based."""
    return [int(link) + 1 for link in np.flatnonzero(np.linalg.norm(force, axis=-1) > TOUCH)]


def total_force(run: Trajectory, start: float, end: float) -> float:
    """Sum of the links' force magnitudes, averaged over a time [N]."""
    return float(np.linalg.norm(run.contact_force[between(run, start, end)], axis=-1).sum(axis=-1).mean())


class Torque(NamedTuple):
    """Root mean square and largest joint torque [N m]."""

    rms: float
    peak: float


def torque(run: Trajectory, start: float, end: float) -> Torque:
    """Joint torques over a time, all joints together."""
    torques = run.joint_torque[between(run, start, end)]
    return Torque(float(np.sqrt(np.mean(torques**2))), float(np.abs(torques).max()))


def torque_beyond(run: Trajectory, other: Trajectory, start: float, end: float) -> float:
    """Root mean square of what the joint torques have beyond those of another run [N m]."""
    return float(np.sqrt(torque(run, start, end).rms ** 2 - torque(other, start, end).rms ** 2))


def roughness(run: Trajectory, window: float = 0.03) -> float:
    """Root mean square distance of the path of link 6 along +x from its own mean over a window [m]."""
    path, grid = run.position[:, MIDDLE], 1e-3
    order = np.argsort(path[:, 0])
    x = np.arange(path[:, 0].min(), path[:, 0].max(), grid)
    y = np.interp(x, path[order, 0], path[order, 1])
    weights = np.hanning(2 * round(0.5 * window / grid) + 1)[1:-1]
    off = np.convolve(y, weights / weights.sum(), "valid")
    first = len(weights) // 2
    return float(np.sqrt(np.mean((y[first : first + len(off)] - off) ** 2)))


def collisions(run: Trajectory) -> tuple[float, float]:
    """Share of the spikes of contact force, and of all samples, that come just after a link touches a peg anew."""
    force = np.linalg.norm(run.contact_force, axis=-1)
    touching = force > TOUCH
    anew = np.zeros(len(force), np.bool_)
    anew[2:] = (touching[2:] & ~touching[1:-1] & ~touching[:-2]).any(axis=1)
    reach = round(AFTER_COLLISION / (run.time[1] - run.time[0]))
    recent = np.convolve(anew, np.ones(reach + 1))[: len(anew)] > 0.0
    spike = (force > SPIKE * np.median(force[touching])).any(axis=1)
    return float(recent[spike].mean()), float(recent.mean())
