"""What scripted controllers share: numbers to tune, one value or one per robot, and commands in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snake_env.policies.gaits import DEGREE
from snake_env.policies.interface import PolicyBase
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.scripted.sensors import Array, Sensors

AMPLITUDES = (25 * DEGREE, 65 * DEGREE)
OMEGAS = (80 * DEGREE, 200 * DEGREE)
BETAS = (-65 * DEGREE, -25 * DEGREE)
"""Waves that the tuning tries [rad, rad/s, rad]."""


class Controller(PolicyBase):
    """A scripted policy with named parameters.

    A subclass gives ``ranges``, the bounds within which tuning chooses each parameter, and :meth:`command`.

    Args:
        values: each parameter by name: one number, or an array (n,) with one per robot, as in tuning.
        name: shown in tables; by default ``title``.
    """

    title: ClassVar[str]
    mode: ClassVar[str]
    """Action mode of the environment."""
    ranges: ClassVar[Mapping[str, tuple[float, float]]]

    def __init__(self, values: Mapping[str, Any], name: str | None = None) -> None:
        if set(values) != set(self.ranges):
            raise ValueError(f"{self.title}: {sorted(values)}: expected values for {sorted(self.ranges)}")
        about = (type(self).__doc__ or "").partition("\n")[0]
        super().__init__(PolicyCard(name or self.title, about, env_options={"action_mode": self.mode}))
        self._values = dict(values)
        self.num_envs = 0

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes."""
        self.sensors = Sensors(layout)
        self.period = float(layout["control_period"])
        self.num_envs = num_envs
        self.joints = self.sensors.size("joint_angle")
        self._low, self._high = (np.array([entry[end] for entry in layout["action"]]) for end in ("low", "high"))
        self.parameters = {name: np.broadcast_to(np.float64(value), num_envs) for name, value in self._values.items()}
        self.reset(np.ones(num_envs, np.bool_))

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,)."""

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a) in [-1, 1] for observations (n, o).

        Raises:
            ConfigError: the observations are not those of the environment that it has begun in.
        """
        if self.num_envs != len(observation):
            self.begin_as_trained(len(observation))
        self.require_inputs(observation.shape[1], self.sensors.width)
        self.sensors.read(observation)
        command = self.command()
        if self.mode == "gait":  # in 3D the vertical wave, whose parameters come last, is zero
            command = np.pad(command, ((0, 0), (0, len(self._low) - command.shape[1])))
        action = (2.0 * command - self._low - self._high) / (self._high - self._low)
        return np.clip(action, -1.0, 1.0).astype(np.float32)

    def command(self) -> Array:
        """Physical values (n, a) of the action's entries, for what the sensors measure."""
        raise NotImplementedError

    def __getitem__(self, name: str) -> Array:
        """A parameter, one value per robot (n,)."""
        return self.parameters[name]
