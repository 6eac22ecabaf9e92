"""The processes of one machine that share a run of PPO, over torch.distributed with gloo."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from training.budget import StopRequest
from training.config import PpoConfig
from training.learners.agent import Agent
from training.learners.collector import Collector, Rollout
from training.learners.group import ProcessGroup
from training.learning_curve import Note


class GlooGroup(ProcessGroup):
    """This process among all of a run, each with an equal share of the robots.

    Args:
        rank: of this process.
        size: number of processes; divides the number of robots.
        meeting: file by which they find each other; it does not exist yet.
        num_envs: robots of the run.
    """

    def __init__(self, rank: int, size: int, meeting: Path, num_envs: int) -> None:
        os.environ.setdefault("GLOO_SOCKET_IFNAME", "lo")  # all are on this machine
        dist.init_process_group("gloo", init_method=f"file://{meeting}", rank=rank, world_size=size)
        self.rank, self.size, self._num_envs = rank, size, num_envs
        self._module: DistributedDataParallel | None = None

    def __enter__(self) -> GlooGroup:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if error is None:  # else another process may be gone, for which this would wait
            dist.destroy_process_group()

    def robots(self, num_envs: int) -> slice:
        """Those of this process, of the ``num_envs`` robots of a run."""
        share = num_envs // self.size
        return slice(self.rank * share, (self.rank + 1) * share)

    def gathered(self, values: Tensor) -> Tensor:
        """Values of all robots (T, n, ...), from those of the robots of each process (T, share, ...)."""
        parts = [torch.empty_like(values) for _ in range(self.size)]
        dist.all_gather(parts, values.contiguous())
        return torch.cat(parts, dim=1)

    def collected(self, value: Any) -> list[Any]:
        """An object of each process."""
        found = [None] * self.size
        dist.all_gather_object(found, value)
        return found

    def own(self, part: Tensor) -> tuple[Tensor, Tensor | slice]:
        """This process's share of a minibatch: indices into values of its robots, and which of ``part`` they are."""
        robots = self.robots(self._num_envs)
        step, robot = part // self._num_envs, part % self._num_envs
        mine = (robot >= robots.start) & (robot < robots.stop)
        return (step * (robots.stop - robots.start) + robot - robots.start)[mine], mine

    def total(self, value: Tensor) -> Tensor:
        """Sum over the processes."""
        value = value.clone()
        dist.all_reduce(value)
        return value

    def module(self, agent: nn.Module) -> nn.Module:
        """The agent, whose gradients are means over the processes."""
        if self._module is None or self._module.module is not agent:
            self._module = DistributedDataParallel(agent)
        return self._module

    def stop_request(self) -> StopRequest:
        """Ends a run in all processes after the same update."""
        return AgreedStop(self)


class AgreedStop(StopRequest):
    """Stops a run in all processes after the same update, when one of them has received a termination signal.

    Args:
        group: the processes.
    """

    SIGNALS = (signal.SIGTERM,)

    def __init__(self, group: GlooGroup) -> None:
        super().__init__()
        self._group = group

    @property
    def received(self) -> bool:
        """Whether one of the processes has received a termination signal; all must call this at the same time."""
        return bool(self._group.total(torch.tensor(float(self._asked))) > 0.0)


class SharedCollector(Collector):
    """Steps this process's robots; reports the finished episodes of all, and saves the states of all.

    Args:
        config: of the run.
        seed: of the first robot of the run.
        used: share of the training budget used up before.
        note: receives the finished episodes.
        group: the processes.
    """

    def __init__(self, config: PpoConfig, seed: int, used: float, note: Note, group: GlooGroup) -> None:
        self._ended: list[tuple[float, Mapping[str, Any]]] = []
        self._group, self._note_all = group, note
        robots = group.robots(config.num_envs)
        super().__init__(config, seed, used, lambda *episode: self._ended.append(episode), robots)

    def collect(self, agent: Agent, noise: torch.Generator, gamma: float) -> tuple[Rollout, Tensor]:
        """As :meth:`Collector.collect`, of this process's robots."""
        found = super().collect(agent, noise, gamma)
        ended, self._ended = self._ended, []
        for episode in (one for part in self._group.collected(ended) for one in part):
            self._note_all(*episode)
        return found

    def state(self) -> dict[str, Tensor]:
        """All that continues the robots of all processes; the same as of a :class:`Collector` of all."""
        states = self._group.collected(super().state())
        return {name: torch.cat([state[name] for state in states]) for name in states[0]}

    def restore(self, state: dict[str, Tensor]) -> None:
        """Continues this process's robots from the state of all, whatever the number of processes that left it."""
        ends = np.cumsum([0, *state["lengths"].tolist()])
        core = slice(int(ends[self._robots.start]), int(ends[self._robots.stop]))
        super().restore({name: value[core if name == "core" else self._robots] for name, value in state.items()})
