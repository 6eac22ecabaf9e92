"""Left and right are alike: what a mirror does to observations and actions, and networks that know it.

Seen in a mirror along the goal direction, a robot in a field is a robot in a mirrored field, drawn as often as the
first. A policy f loses nothing by treating both alike, f(S o) = S f(o), and learns from each step for both. S changes
signs alone: of angles, of what points to the left, and of the wave's phase, which lies half a turn further. In space
pitch and height stay, so with the phase the amplitude of the vertical wave changes its sign; angular velocities change
theirs but about the axis to the left.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from snake_env import ConfigError

Signs = NDArray[np.float32]


class Mirror(NamedTuple):
    """Signs, 1 or -1, of the elements of an observation (o,) and an action (a,)."""

    observation: Signs
    action: Signs

    @classmethod
    def of(cls, layout: dict[str, Any]) -> Mirror:
        """For an environment's ``layout``, whose rows state the signs ("mirror").

        Raises:
            ConfigError: action zero lifts: half a turn later the vertical wave is the mirror image with the opposite
                amplitude, which is then no change of sign.
        """
        for entry in layout["action"]:
            if entry["name"] == "lift" and entry["low"] != -entry["high"]:
                asked = 'false, another task, or action_mode "joints": in task "free" action zero lifts'
                raise ConfigError("policy.mirror", True, asked)
        observation = [sign for block in layout["observation"] for sign in block["mirror"]]
        action = [entry["mirror"] for entry in layout["action"]]
        return cls(np.array(observation, np.float32), np.array(action, np.float32))

    def arrays(self) -> dict[str, Signs]:
        """The signs as the file of a policy names them."""
        return {f"mirror.{name}": of for name, of in self._asdict().items()}


class Mirrored(nn.Module):
    """The mean of what a network says and of what it says in the mirror, mirrored back.

    Args:
        network: from observations (n, o) to outputs (n, k).
        seen: signs of the observation (o,).
        said: signs of the outputs (k,).
    """

    def __init__(self, network: nn.Module, seen: Signs, said: Signs) -> None:
        super().__init__()
        self.network = network
        self._seen, self._said = torch.from_numpy(seen), torch.from_numpy(said)

    def forward(self, observation: Tensor) -> Tensor:
        """Outputs (n, k)."""
        plain, mirrored = self.network(torch.cat([observation, observation * self._seen])).chunk(2)
        return 0.5 * (plain + mirrored * self._said)
