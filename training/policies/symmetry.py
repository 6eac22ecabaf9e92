"""Left-right symmetry: what a reflection does to observations and actions, and networks that respect it.

Reflected about the goal direction, a robot in a field is a robot in the reflected field, which is drawn as often as the
first. A policy f loses nothing by treating both alike, f(S o) = S f(o), and learns from each step for both. S changes
signs: of angles, of what points to the left, and of the wave's phase, which lies half a turn further. Rays to both
sides trade places. In 3D pitch and height stay, so with the phase the amplitude of the vertical wave changes its sign;
angular velocities change theirs except about the axis to the left.
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
    """Signs, 1 or -1, of the elements of an observation (o,) and an action (a,).

    ``order`` (o,): the reflected observation has the element ``order[k]`` in the place k, before its sign.
    """

    observation: Signs
    action: Signs
    order: NDArray[np.int64]

    def observed(self, observation: NDArray[Any]) -> NDArray[Any]:
        """The reflected observation (..., o)."""
        reflected: NDArray[Any] = observation[..., self.order] * self.observation
        return reflected

    def part(self, elements: Sequence[int]) -> Reflection:
        """Of the observation that has only these elements, with both of each pair that trades places."""
        places = {element: place for place, element in enumerate(elements)}
        order = np.array([places[int(element)] for element in self.order[elements]])
        return Reflection(self.observation[elements], self.action, order)

    @classmethod
    def of(cls, layout: dict[str, Any]) -> Reflection:
        """For an environment's ``layout``, whose rows state the signs ("mirror").

        Raises:
            ConfigError: action zero lifts: half a turn later the vertical wave is the reflection with the opposite
                amplitude, which is then no change of sign. Or a joint has no mirror image.
        """
        _require_mirror_image(Robot.of(layout["config"]["robot"]))
        for entry in layout["action"]:
            if entry["name"] == "lift" and entry["low"] != -entry["high"]:
                expected = 'false, another task, or action_mode "joints": in task "free" action zero lifts'
                raise ConfigError("policy.symmetric", True, expected)
        signs = np.array([sign for block in layout["observation"] for sign in block["mirror"]], np.float32)
        other = [
            block["start"] + block["size"] - 1 - k for block in layout["observation"] for k in range(block["size"])
        ]
        order = np.where(signs == 0, other, np.arange(len(signs)))
        action = np.array([entry["mirror"] for entry in layout["action"]], np.float32)
        return cls(np.where(signs == 0, np.float32(1), signs), action, order)

    def arrays(self) -> dict[str, Signs]:
        """Signs and order as the file of a policy names them; no order where all elements keep their places."""
        found = {"mirror.observation": self.observation, "mirror.action": self.action}
        if (self.order != np.arange(len(self.order))).any():
            found["mirror.order"] = self.order.astype(np.float32)
        return found


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
        reflection: Of observations.
        outputs: Signs of the outputs (k,).
    """

    def __init__(self, network: nn.Module, reflection: Reflection, outputs: Signs) -> None:
        super().__init__()
        self.network = network
        self._inputs, self._outputs = torch.from_numpy(reflection.observation), torch.from_numpy(outputs)
        kept = (reflection.order == np.arange(len(reflection.order))).all()
        self._order = None if kept else torch.from_numpy(reflection.order)

    def forward(self, observation: Tensor) -> Tensor:
        """Outputs (n, k)."""
        ordered = observation if self._order is None else observation.index_select(-1, self._order)
        plain, reflected = self.network(torch.cat([observation, ordered * self._inputs])).chunk(2)
        return 0.5 * (plain + reflected * self._outputs)
