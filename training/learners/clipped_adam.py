"""Adam with gradients clipped to a norm, over all parameters of a module as one vector."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn


class ClippedAdam:
    """The optimiser of PPO; a step on one vector takes a fraction of the time of one on many small tensors.

    Args:
        module: Its parameters become parts of one vector, in which they stay.
    """

    def __init__(self, module: nn.Module) -> None:
        self._parameters = list(module.parameters())
        vector = torch.cat([one.detach().flatten() for one in self._parameters])
        for one, part in zip(self._parameters, vector.split([one.numel() for one in self._parameters]), strict=True):
            one.data = part.view_as(one)
        self._vector = nn.Parameter(vector)
        self._adam = torch.optim.Adam([self._vector], eps=1e-5, fused=True)

    def set_rate(self, rate: float) -> None:
        """Sets the learning rate."""
        self._adam.param_groups[0]["lr"] = rate

    def step(self, max_norm: float) -> Tensor:
        """Follows the gradients of the parameters, shortened to ``max_norm``, and clears them.

        Returns:
            Their norm before.
        """
        gradient = torch.cat([one.grad.flatten() for one in self._parameters if one.grad is not None])
        for one in self._parameters:
            one.grad = None
        norm = gradient.norm()
        self._vector.grad = gradient.mul_((max_norm / (norm + 1e-6)).clamp(max=1.0))
        self._adam.step()
        return norm

    def state_dict(self) -> dict[str, Any]:
        """What continues the optimiser."""
        return self._adam.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what :meth:`state_dict` returned."""
        self._adam.load_state_dict(state)
