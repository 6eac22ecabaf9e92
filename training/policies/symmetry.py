"""Left-right symmetry: what a reflection does to observations and actions, and networks that respect it.

Reflected about the goal direction, a robot in a field is a robot in the reflected field, which is drawn as often as the
first. A policy f loses nothing by treating both alike, f(S o) = S f(o), and learns from each step for both. S changes
only signs: of angles, of what points to the left, and of the wave's phase, which lies half a turn further. In 3D pitch
and height stay, so with the phase the amplitude of the vertical wave changes its sign; angular velocities change theirs
except about the axis to the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from snake_env import ConfigError, Robot

Signs = NDArray[np.float32]


class Reflection(NamedTuple):
    """Signs, 1 or -1, of the elements of an observation (o,) and an action (a,)."""

    observation: Signs
    action: Signs

    @classmethod
    def of(cls, layout: dict[str, Any]) -> Reflection:
        """For an environment's ``layout``, whose rows state the signs ("mirror").

        Raises:
            ConfigError: action zero lifts: half a turn later the vertical wave is the reflection with the opposite
                amplitude, which is then no change of sign. Or the mirror image of a joint is another joint, or that
                of a ray another ray.
        """
        _require_mirror_image(Robot.of(layout["config"]["robot"]))
        for entry in layout["action"]:
            if entry["name"] == "lift" and entry["low"] != -entry["high"]:
                expected = 'false, another task, or action_mode "joints": in task "free" action zero lifts'
                raise ConfigError("policy.symmetric", True, expected)
        for block in layout["observation"]:
            if 0 in block["mirror"]:
                expected = f"false, or an observation without the block {block['name']}, whose elements trade places"
                raise ConfigError("policy.symmetric", True, expected)
        observation = [sign for block in layout["observation"] for sign in block["mirror"]]
        action = [entry["mirror"] for entry in layout["action"]]
        return cls(np.array(observation, np.float32), np.array(action, np.float32))

    def arrays(self) -> dict[str, Signs]:
        """The signs as the file of a policy names them."""
        return {f"mirror.{name}": signs for name, signs in self._asdict().items()}


def _require_mirror_image(robot: Robot) -> None:
    """Refuses oblique axes, and limits to one side more than to the other of axes whose angles change their signs."""
    limits = robot.joint_limit if isinstance(robot.joint_limit, Sequence) else [None] * (robot.links - 1)
    for joint, axis in robot.joint_axes:
        limit = limits[joint]
        is_oblique = isinstance(axis, tuple) and axis[0] != 0.0 and any(axis[1:])
        changes_sign = any(axis[1:]) if isinstance(axis, tuple) else axis != "pitch"
        is_one_sided = isinstance(limit, Sequence) and limit[0] != -limit[1]
        if is_oblique or (changes_sign and is_one_sided):
            expected = f"false: joint {joint} of the robot turns about {axis}, within {limit}, and has no mirror image"
            raise ConfigError("policy.symmetric", True, expected)


class SymmetricNetwork(nn.Module):
    """The mean of a network's output and of its reflected output for the reflected observation.

    Args:
        network: From observations (n, o) to outputs (n, k).
        inputs: Signs of the observation (o,).
        outputs: Signs of the outputs (k,).
    """

    def __init__(self, network: nn.Module, inputs: Signs, outputs: Signs) -> None:
        super().__init__()
        self.network = network
        self._inputs, self._outputs = torch.from_numpy(inputs), torch.from_numpy(outputs)

    def forward(self, observation: Tensor) -> Tensor:
        """Outputs (n, k)."""
        plain, reflected = self.network(torch.cat([observation, observation * self._inputs])).chunk(2)
        return 0.5 * (plain + reflected * self._outputs)
