"""Observations in SI units: the same for scripted controllers and learned policies."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.errors import ConfigError

Array = NDArray[np.float64]


class Sensors:
    """Reads the named blocks of an environment's observation.

    Args:
        layout: the environment's ``layout``.
    """

    def __init__(self, layout: dict[str, Any]) -> None:
        self._blocks = {block["name"]: block for block in layout["observation"]}
        self.width = sum(block["size"] for block in layout["observation"])
        self._observation: NDArray[np.float32] = np.zeros((0, 0), np.float32)

    def read(self, observation: NDArray[np.float32]) -> None:
        """Takes the present observation (n, o)."""
        self._observation = observation

    def has(self, name: str) -> bool:
        """The observation has such a block."""
        return name in self._blocks

    def size(self, name: str) -> int:
        """Elements of a block."""
        return int(self._blocks[name]["size"])

    def __getitem__(self, name: str) -> Array:
        """A block (n, k) in its unit; values beyond the observation's bounds are clipped to them.

        Raises:
            ConfigError: the observation does not have it.
        """
        if name not in self._blocks:
            raise ConfigError("observation_blocks", ", ".join(self._blocks), f"{name} too, which the controller reads")
        block = self._blocks[name]
        start = block["start"]
        return self._observation[:, start : start + block["size"]] * np.float64(block["scale"])

    @property
    def heading(self) -> Array:
        """Angle from the goal direction to the mean body direction (n,) [rad]; positive: to the left."""
        return np.arctan2(self["heading"][:, 0], self["heading"][:, 1])

    @property
    def speed(self) -> Array:
        """Speed of the centre of gravity (n,) [m/s]."""
        return np.hypot(*self["velocity"].T)

    @property
    def phase(self) -> Array:
        """Phase of the commanded wave at joint 1 (n,) [rad]; in action modes with a wave."""
        return np.arctan2(self["wave"][:, 0], self["wave"][:, 1])

    @property
    def link_directions(self) -> Array:
        """Angle from the goal direction to the forward direction of each link (n, links) [rad].

        A joint angle is the turn to the right from the link behind it to the link ahead; the mean over the links is
        the heading.
        """
        turns = np.cumsum(self["joint_angle"], axis=1)
        relative = np.concatenate([np.zeros((len(turns), 1)), turns], axis=1)
        mean = np.arctan2(np.sin(relative).sum(axis=1), np.cos(relative).sum(axis=1))
        return relative + (self.heading - mean)[:, None]

    @property
    def pegs(self) -> Array:
        """Centres and radii of located pegs (3, k, n) [m], from the leading link's middle, x along the goal direction.

        Where fewer pegs are in range, the others are placed out of reach.
        """
        block = self._blocks["pegs"]
        forward, left, proximity = self["pegs"].reshape(len(self._observation), -1, 3).transpose(2, 1, 0)
        seen = (forward != 0.0) | (left != 0.0)
        radius = np.hypot(forward, left) + proximity - block["scale"]
        cos, sin = np.cos(self.link_directions[:, 0]), np.sin(self.link_directions[:, 0])
        x, y = forward * cos - left * sin, forward * sin + left * cos
        return np.stack([np.where(seen, x, FAR), np.where(seen, y, FAR), np.where(seen, radius, 0.0)])


FAR = 100.0
"""Where pegs are said to be that are not there [m]."""
