"""Numbers of section 7.3.5: tracking of joint 5, torques, the virtual joints' velocities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snake_env.config import Gait
from snake_env.reproduce.experiment import PERIOD
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]

JOINT = 4
"""Index of joint 5, one of the two middle joints."""
STATIONARY = 5.0
"""Time from which motion counts as stationary: the soft start is over [s]."""
SOFT = Gait(soft_start=True)


def errors(run: Trajectory) -> Array:
    """Tracking errors phi - phi_d of all joints (T, n - 1) [deg]."""
    return np.degrees(run.joint_angle - SOFT.reference(run.time)["angle"])


def stationary(run: Trajectory) -> NDArray[np.bool_]:
    """Which samples are (T,)."""
    return run.time >= STATIONARY


def largest_error(run: Trajectory) -> float:
    """Of joint 5 in stationary motion [deg]."""
    return float(np.abs(errors(run)[stationary(run), JOINT]).max())


def rms_error(run: Trajectory) -> float:
    """Of joint 5 in stationary motion [deg]."""
    return float(np.sqrt(np.mean(errors(run)[stationary(run), JOINT] ** 2)))


def rms_torque(run: Trajectory) -> float:
    """Of joint 5 in stationary motion [N m]."""
    return float(np.sqrt(np.mean(run.joint_torque[stationary(run), JOINT] ** 2)))


def starting_error(run: Trajectory) -> float:
    """Largest error of any joint during the soft start [deg]."""
    return float(np.abs(errors(run)[~stationary(run)]).max())


def time_off(run: Trajectory, bound: float = 0.5) -> float:
    """How long joint 5 is further than ``bound`` degrees off during the soft start [s]."""
    off = np.abs(errors(run)[~stationary(run), JOINT]) > bound
    return float(off.sum() * (run.time[1] - run.time[0]))


def fastest(run: Trajectory, start: float, end: float) -> Array:
    """Largest |v_O2| and |theta'| from ``start`` to ``end`` (2,) [m/s, rad/s]."""
    assert run.passive_velocity is not None, "a run of the minimal model"
    w = run.passive_velocity[(run.time >= start) & (run.time <= end)]
    return np.array([np.hypot(w[:, 0], w[:, 1]).max(), np.abs(w[:, 2]).max()])


def repeats(run: Trajectory) -> float:
    """Difference of joint 5's stationary error from itself a period later, over its largest value."""
    error = errors(run)[stationary(run), JOINT]
    shift = round(PERIOD / (run.time[1] - run.time[0]))
    return float(np.abs(error[shift:] - error[:-shift]).max() / np.abs(error).max())


def likeness(one: Trajectory, other: Trajectory) -> float:
    """Correlation of joint 5's stationary errors."""
    a, b = (errors(run)[stationary(run), JOINT] for run in (one, other))
    return float(np.corrcoef(a, b)[0, 1])
