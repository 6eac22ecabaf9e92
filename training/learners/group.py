"""The processes among which a run of PPO shares its robots and its updates; by default there is only one."""

from __future__ import annotations

from typing import Any

from torch import Tensor, nn

from training.budget import StopRequest


class ProcessGroup:
    """A group of one process, which has all robots and takes every gradient step; base class of larger groups.

    Attributes:
        size: Number of processes.
    """

    size = 1

    def robots(self, num_envs: int) -> slice:
        """Those of this process, of the ``num_envs`` robots of a run."""
        return slice(0, num_envs)

    def gathered(self, values: Tensor) -> Tensor:
        """Values of all robots (T, n, ...), from those of the robots of each process (T, share, ...)."""
        return values

    def collected(self, value: Any) -> list[Any]:
        """An object of each process."""
        return [value]

    def own(self, part: Tensor) -> tuple[Tensor, Tensor | slice]:
        """This process's share of a minibatch.

        Args:
            part: Samples (k,), as indices into values (T, n) of all robots.

        Returns:
            Indices into values of its own robots, and which of ``part`` they are.
        """
        return part, slice(None)

    def total(self, value: Tensor) -> Tensor:
        """Sum over the processes."""
        return value

    def module(self, agent: nn.Module) -> nn.Module:
        """The agent, whose gradients are means over the processes."""
        return agent

    def stop_request(self) -> StopRequest:
        """Ends a run in all processes after the same update."""
        return StopRequest()
