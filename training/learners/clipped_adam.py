"""Adam with gradients clipped to a norm, over all parameters of a module as one vector."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn


class ClippedAdam:
    """The optimiser of PPO; a step on one vector takes a fraction of the time of one on many small tensors.

    Written out because making an optimiser of torch loads torch's compiler.

    Args:
        module: Its parameters become parts of one vector, in which they stay. A second optimiser would move them to its
            own.

    Attributes:
        rate: Learning rate, the step size of Adam.
    """

    def __init__(self, module: nn.Module) -> None:
        self._parameters = list(module.parameters())
        self._vector = torch.cat([one.detach().flatten() for one in self._parameters])
        sizes = [one.numel() for one in self._parameters]
        for one, part in zip(self._parameters, self._vector.split(sizes), strict=True):
            one.data = part.view_as(one)
        self.rate = 1e-3
        self._steps = 0
        self._mean = torch.zeros_like(self._vector)
        self._square = torch.zeros_like(self._vector)

    @torch.no_grad()
    def step(self, max_norm: float) -> Tensor:
        """Follows the gradients of the parameters, shortened to ``max_norm``, and clears them.

        Algorithm 1 of Kingma and Ba (2015).

        Returns:
            The norm of the gradients before.
        """
        gradient = torch.cat([one.grad.flatten() for one in self._parameters if one.grad is not None])
        for one in self._parameters:
            one.grad = None
        norm = gradient.norm()
        gradient.mul_((max_norm / (norm + 1e-6)).clamp(max=1.0))
        self._steps += 1
        self._mean.lerp_(gradient, 1.0 - MEAN_DECAY)
        self._square.mul_(SQUARE_DECAY).addcmul_(gradient, gradient, value=1.0 - SQUARE_DECAY)
        spread = self._square.sqrt().mul_((1.0 - SQUARE_DECAY**self._steps) ** -0.5)
        self._vector.addcdiv_(self._mean, spread.add_(EPSILON), value=-self.rate / (1.0 - MEAN_DECAY**self._steps))
        return norm

    def state_dict(self) -> dict[str, Any]:
        """What continues the optimiser, named as in ``torch.optim.Adam``, whose states can be taken over."""
        return {"state": {0: {"step": self._steps, "exp_avg": self._mean, "exp_avg_sq": self._square}}}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what :meth:`state_dict` returned, or that of ``torch.optim.Adam``, empty before its first step."""
        if 0 in state["state"]:
            kept = state["state"][0]
            self._steps = int(kept["step"])
            self._mean.copy_(kept["exp_avg"])
            self._square.copy_(kept["exp_avg_sq"])


MEAN_DECAY, SQUARE_DECAY, EPSILON = 0.9, 0.999, 1e-5
"""beta_1, beta_2 and epsilon of Adam."""
