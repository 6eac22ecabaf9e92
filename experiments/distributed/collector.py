"""The robots of a run shared among actors of a Ray cluster."""

from __future__ import annotations

from typing import Any, cast

import ray
import torch
from torch import Tensor

from snake_env import ConfigError
from training.config import PpoConfig
from training.learners.agent import Agent, make_agent
from training.learners.collector import ARRAYS, Collector, Rollout
from training.learning_curve import Note


@ray.remote
class Worker:
    """Steps one share of the robots, on whatever node Ray puts it.

    Args:
        config: of the run, with the robots and threads of this share.
        seed: of its first robot.
        used: share of the training budget used up before.
    """

    def __init__(self, config: PpoConfig, seed: int, used: float) -> None:
        torch.set_num_threads(1)
        self._ended: list[tuple[float, dict[str, float]]] = []
        self._collector = Collector(config, seed, used, lambda *episode: self._ended.append(episode))
        self._agent = make_agent(config, *self.sizes())
        self._noise = torch.Generator().manual_seed(seed)

    def sizes(self) -> tuple[int, int]:
        """Elements of an observation and of an action."""
        return self._collector.observations, self._collector.actions

    def collect(self, weights: dict[str, Tensor], gamma: float) -> tuple[dict[str, Any], Any, list[Any], float]:
        """A rollout's arrays, the value of what comes after it, the episodes that have ended, and the time in the
        simulator since the start [s].
        """
        self._agent.load_state_dict(weights)
        rollout, last_value = self._collector.collect(self._agent, self._noise, gamma)
        ended, self._ended = self._ended, []
        arrays = {name: getattr(rollout, name) for name in ARRAYS}
        return arrays, last_value, ended, self._collector.simulator_seconds

    def advance(self, used: float) -> None:
        """Sets the difficulty of the episodes that begin from now on."""
        self._collector.advance(used)

    def state(self) -> dict[str, Tensor]:
        """All that continues the share bit for bit."""
        return self._collector.state() | {"noise": self._noise.get_state()}

    def restore(self, state: dict[str, Tensor]) -> None:
        """Continues the share from :meth:`state`."""
        self._noise.set_state(state["noise"])
        self._collector.restore(state)


class RayCollector:
    """Stands for a :class:`training.learners.collector.Collector` whose robots are shared among actors.

    Args:
        config: of the run.
        seed: of the first robot.
        used: share of the training budget used up before.
        note: receives the finished episodes.
        workers: number of actors; divides the number of robots.

    Attributes:
        simulator_seconds: time that the slowest actor has spent in the simulator [s].

    Raises:
        ConfigError: it does not.
    """

    def __init__(self, config: PpoConfig, seed: int, used: float, note: Note, workers: int) -> None:
        if workers < 1 or config.num_envs % workers:
            raise ConfigError("workers", workers, f"a divisor of num_envs = {config.num_envs}")
        self._share = config.num_envs // workers
        of_worker = config.with_changes(num_envs=self._share)
        make = cast(Any, Worker).options(num_cpus=config.num_threads)
        self._workers = [make.remote(of_worker, seed + k * self._share, used) for k in range(workers)]
        self.observations, self.actions = ray.get(self._workers[0].sizes.remote())
        self._rollout = Rollout(config.ppo.n_steps, config.num_envs, self.observations, self.actions)
        self._note = note
        self.simulator_seconds = 0.0

    def collect(self, agent: Agent, noise: torch.Generator, gamma: float) -> tuple[Rollout, Tensor]:
        """Fills the rollout with fresh steps of all actors, in the order of the robots."""
        weights = ray.put(agent.state_dict())
        parts = ray.get([worker.collect.remote(weights, gamma) for worker in self._workers])
        for k, (arrays, _, ended, _) in enumerate(parts):
            robots = slice(k * self._share, (k + 1) * self._share)
            for name, values in arrays.items():
                getattr(self._rollout, name)[:, robots] = values
            for episode in ended:
                self._note(*episode)
        self.simulator_seconds = max(seconds for *_, seconds in parts)
        return self._rollout, torch.cat([last_value for _, last_value, *_ in parts])

    def advance(self, used: float) -> None:
        """Sets the difficulty of the episodes that begin from now on."""
        for worker in self._workers:
            worker.advance.remote(used)

    def state(self) -> dict[str, Tensor]:
        """All that continues the robots bit for bit, actor by actor."""
        states = ray.get([worker.state.remote() for worker in self._workers])
        return {f"{k}/{name}": value for k, state in enumerate(states) for name, value in state.items()}

    def restore(self, state: dict[str, Tensor]) -> None:
        """Continues the robots from :meth:`state`, with as many actors as then."""
        for k, worker in enumerate(self._workers):
            prefix = f"{k}/"
            own = {name.removeprefix(prefix): value for name, value in state.items() if name.startswith(prefix)}
            ray.get(worker.restore.remote(own))

    def close(self) -> None:
        """Ends the actors."""
        for worker in self._workers:
            ray.kill(worker)
