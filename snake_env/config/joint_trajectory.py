"""Joint references of the user's own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env import _checks
from snake_env._native import sampled_reference
from snake_env.config.gait import MOST_JOINTS, Gait
from snake_env.config.robot import Robot
from snake_env.errors import ConfigError

Array = NDArray[np.float64]

INTERVAL = 0.005
"""Time between samples of a reference that is given by functions [s]; cubics in between follow it to 1e-9 rad."""
MOST_INTERVALS = 10**7
"""Between samples; as many as a simulation has."""


class JointReference(Protocol):
    """A reference by functions of time: those of :class:`JointTrajectory` are the ones that a simulation follows."""

    def angle(self, time: float) -> ArrayLike:
        """Angles of all joints at a time (joints,), in 3D (joints, 2) yaw and pitch [rad]."""

    def rate(self, time: float) -> ArrayLike:
        """Their rates [rad/s]."""


@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Joint angles sampled in time, as the ``gait`` of :func:`snake_env.simulate`. Cubics lead from sample to sample.
    Without ``rate`` the reference stays between neighbouring samples and has the rate zero where they turn
    (Fritsch and Butland 1984). Before the first and after the last sample the joints hold their angles.

    Args:
        time: (T,) increasing times of at least two samples; the run begins at zero [s].
        angle: (T, joints) angles [rad]; for the spatial model also (T, joints, 2), yaw and pitch. (T, axes) for a robot
            with ``axes`` of its own, as :attr:`snake_env.Robot.joint_axes` lists them.
        rate: rates at the samples [rad/s], of the shape of ``angle``; None for those that follow from the angles.

    Raises:
        ConfigError: names what is not finite, not in order or not of the right shape.
    """

    _section: ClassVar[str] = "gait"

    time: ArrayLike
    angle: ArrayLike
    rate: ArrayLike | None = None

    def __post_init__(self) -> None:
        time, angle = _array("time", self.time), _array("angle", self.angle)
        if time.ndim != 1:
            raise ConfigError("gait.time", f"an array of shape {time.shape}", "times (T,)")
        if angle.ndim not in (2, 3) or angle.shape[0] != len(time) or (angle.ndim == 3 and angle.shape[2] != 2):
            expected = f"angles ({len(time)}, joints), or ({len(time)}, joints, 2) of yaw and pitch"
            raise ConfigError("gait.angle", f"an array of shape {angle.shape}", expected)
        rate = None if self.rate is None else _array("rate", self.rate)
        if rate is not None and rate.shape != angle.shape:
            raise ConfigError("gait.rate", f"an array of shape {rate.shape}", f"rates of shape {angle.shape}")
        self._keep(time=time, angle=angle, rate=rate)
        sampled_reference(self.fields(), [], False)

    def reference(self, time: ArrayLike, vertical: bool = False) -> dict[str, Array]:
        """The yaw or pitch references at given times: "angle", "rate", "acceleration", (T, joints) each."""
        is_vertical = _checks.choice("vertical", vertical, [False, True])
        return sampled_reference(self.fields(), _checks.times(time), bool(is_vertical))

    def _keep(self, **arrays: Array | None) -> None:
        """Takes over copies that nobody changes after their check."""
        for name, array in arrays.items():
            if array is not None:
                array.setflags(write=False)
            object.__setattr__(self, name, array)

    def fields(self) -> dict[str, Any]:
        """The samples as the core reads them, one list per joint."""
        fields: dict[str, Any] = {"time": np.asarray(self.time).tolist()}
        for suffix, samples in (("", self.angle), ("_rate", self.rate)):
            if samples is None:
                continue
            table = np.asarray(samples)
            axes = [table] if table.ndim == 2 else [table[..., 0], table[..., 1]]
            fields |= {name + suffix: axis.T.tolist() for name, axis in zip(("yaw", "pitch"), axes, strict=False)}
        return fields

    @classmethod
    def sampled(
        cls,
        reference: Any,
        duration: float,
        joints: int,
        update_rate: float | None = None,
        delay: float = 0.0,
        robot: Robot | None = None,
    ) -> JointTrajectory:
        """Samples of a reference that comes late, or that joints receive at a low rate only.

        Args:
            reference: a :class:`Gait`, a trajectory, or an object with ``angle(time)`` and ``rate(time)``.
            duration: time that is sampled [s].
            joints: number of joints.
            update_rate: how often the joints receive a sample [Hz]; a cubic leads from each to the next, which takes
                one interval. None: all the time.
            delay: time from a reference to its arrival [s], >= 0.
            robot: one with ``axes`` of its own, whose joints take the waves of a gait as in :class:`Robot`.

        Raises:
            ConfigError: names the argument that is not admissible.
        """
        interval = INTERVAL
        if update_rate is not None:
            interval = 1.0 / _checks.number("reference_rate", update_rate, 0.1, 1e4, "None, or ")
        lag = _checks.number("reference_delay", delay, 0.0, 10.0) + (0.0 if update_rate is None else interval)
        intervals = _checks.positive("duration", duration) / interval * (1.0 - 1e-12)
        if intervals > MOST_INTERVALS:
            raise ConfigError("duration", duration, f"at most {MOST_INTERVALS:g} samples of the reference")
        time = np.asarray(interval * np.arange(math.ceil(intervals) + 1), np.float64)
        angle, rate = _samples(reference, time, _checks.integer("joints", joints, 1, MOST_JOINTS), robot)
        return cls(time + lag, angle, rate)


def _samples(reference: Any, time: Array, joints: int, robot: Robot | None) -> tuple[Array, Array]:
    """Angles and rates at given times (T, joints, ...)."""
    if isinstance(reference, Gait | JointTrajectory):
        keywords = {"joints": joints} if isinstance(reference, Gait) else {}
        axes = [reference.reference(time, vertical=vertical, **keywords) for vertical in (False, True)]
        angle, rate = (np.stack([axis[name] for axis in axes], axis=-1) for name in ("angle", "rate"))
        if robot is None:
            flat = not np.any(axes[1]["angle"])
        elif isinstance(reference, JointTrajectory):
            flat = np.ndim(reference.angle) == 2  # one column per axis
        else:
            flat = False
            angle[:, robot.twisting], rate[:, robot.twisting] = 0.0, 0.0
        return (angle[..., 0], rate[..., 0]) if flat else (angle, rate)
    if not callable(getattr(reference, "angle", None)) or not callable(getattr(reference, "rate", None)):
        expected = "a snake_env.Gait, a snake_env.JointTrajectory, or an object with angle(time) and rate(time)"
        raise ConfigError("gait", repr(reference), expected)
    return _array("angle", [reference.angle(t) for t in time]), _array("rate", [reference.rate(t) for t in time])


def _array(name: str, values: Any) -> Array:
    return _checks.reals(f"gait.{name}", values, "an array of numbers")
