"""Rollouts of a batch of robots that act by an agent."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch
from torch import Tensor

from snake_env.policies.memory import MemoryTraces, network_inputs
from training.config import Ppo, PpoConfig
from training.learners.agent import Agent
from training.learners.mixture import Mixture, parts
from training.learning_curve import SIGNALS, Note


class Rollout:
    """T steps of n robots; every array begins with (T, n).

    Args:
        steps: T.
        num_envs: n.
        observations: elements of an observation.
        actions: elements of an action.
    """

    def __init__(self, steps: int, num_envs: int, observations: int, actions: int) -> None:
        shape = (steps, num_envs)
        self.observation = torch.zeros(*shape, observations)
        self.action = torch.zeros(*shape, actions)
        self.log_density = torch.zeros(shape)
        self.value = torch.zeros(shape)
        self.reward = np.zeros(shape, np.float32)
        self.done = np.zeros(shape, np.bool_)

    def advantages(self, last_value: Tensor, ppo: Ppo) -> tuple[Tensor, Tensor]:
        """Generalised advantages (Schulman et al. 2016) and the returns they imply, (T, n) each."""
        value = self.value.numpy()
        advantage = np.zeros_like(value)
        following, next_value = np.zeros_like(value[0]), last_value.numpy()
        for t in reversed(range(len(value))):
            goes_on = 1.0 - self.done[t]
            error = self.reward[t] + ppo.gamma * goes_on * next_value - value[t]
            following = error + ppo.gamma * ppo.gae_lambda * goes_on * following
            advantage[t], next_value = following, value[t]
        return torch.from_numpy(advantage), torch.from_numpy(advantage + value)


class Collector:
    """Robots that act by the agent, with automatic reset, and report finished episodes.

    Args:
        config: of the run.
        seed: of the first robot's fields; the others take the seeds after it.
        used: share of the training budget used up before.
        note: Is called with each finished episode.

    Attributes:
        simulator_seconds: wall time spent in the simulator [s].
    """

    def __init__(self, config: PpoConfig, seed: int, used: float, note: Note) -> None:
        self._env = Mixture(parts(config), config.num_threads)
        layout, num_envs = self._env.layout, self._env.num_envs
        self._traces = MemoryTraces(layout, config.policy.memory, num_envs)
        self.observations = len(network_inputs(layout, config.policy.memory))
        self.actions = len(layout["action"])
        self._hardest = float(layout["config"]["difficulty"])
        self.rollout = Rollout(config.ppo.n_steps, num_envs, self.observations, self.actions)
        self._deviation = torch.zeros_like(self.rollout.action)
        self._note = note
        self._returns = np.zeros(num_envs)
        self._config = config
        self.advance(used)
        self.observation = torch.from_numpy(self._traces(self._env.reset(seed)))
        self.simulator_seconds = 0.0

    def advance(self, used: float) -> None:
        """Sets the difficulty of the episodes that begin from now on; ``used`` is the share of the budget used up."""
        if self._config.curriculum:
            self._env.set_difficulty(self._config.difficulty(used, self._hardest))

    @torch.inference_mode()
    def collect(self, agent: Agent, noise: torch.Generator, gamma: float) -> tuple[Rollout, Tensor]:
        """Fills the rollout with fresh steps; also returns the value of what comes after them (n,)."""
        rollout = self.rollout
        for t in range(len(rollout.reward)):
            rollout.observation[t] = self.observation
            self._deviation[t].normal_(generator=noise)
            rollout.action[t] = agent.act(self.observation, self._deviation[t])
            start = time.perf_counter()
            observation, reward, terminated, truncated, infos = self._env.step(rollout.action[t].numpy())
            self.simulator_seconds += time.perf_counter() - start
            self._returns += reward
            rollout.reward[t], rollout.done[t] = reward, terminated | truncated
            if "final_obs" in infos:
                self._note_ends(infos)
                cut = np.flatnonzero(truncated & ~terminated)
                if len(cut):  # time was up: the critic's value stands for what would have come
                    last = self._traces.peek(np.stack(infos["final_obs"][cut]), cut)
                    rollout.reward[t, cut] += gamma * agent.value(torch.from_numpy(last)).numpy()
                self._traces.reset(rollout.done[t])
            self.observation = torch.from_numpy(self._traces(observation))
        rollout.log_density[:] = agent.log_density_of(self._deviation)
        rollout.value[:] = agent.value(rollout.observation)
        return rollout, agent.value(self.observation)

    def _note_ends(self, infos: dict[str, Any]) -> None:
        for i in np.flatnonzero(infos["_final_obs"]):
            self._note(self._returns[i], {name: infos["final_info"][name][i] for name in (*SIGNALS, "task")})
            self._returns[i] = 0.0

    def state(self) -> dict[str, Tensor]:
        """All that continues the robots bit for bit: their states, their memory, and the returns of their episodes."""
        states = self._env.get_state()
        traces, new = self._traces.state()
        return {
            "core": torch.frombuffer(bytearray(b"".join(one.core for one in states)), dtype=torch.uint8),
            "lengths": torch.tensor([len(one.core) for one in states]),
            "finished": torch.tensor([one.finished for one in states]),
            "previous_action": torch.from_numpy(np.stack([one.previous_action for one in states])),
            "traces": torch.from_numpy(traces),
            "new": torch.from_numpy(new),
            "returns": torch.from_numpy(self._returns),
            "observation": self.observation,
        }

    def restore(self, state: dict[str, Tensor]) -> None:
        """Continues the robots from :meth:`state`."""
        cores = state["core"].numpy().tobytes()
        ends = np.cumsum(state["lengths"].numpy()).tolist()
        saved = zip([0, *ends], ends, state["finished"].tolist(), state["previous_action"].numpy(), strict=False)
        robots = [
            now._replace(core=cores[start:end], finished=done, previous_action=action.copy())
            for now, (start, end, done, action) in zip(self._env.get_state(), saved, strict=True)
        ]
        self._env.set_state(robots)
        self._traces.restore(state["traces"].numpy(), state["new"].numpy())
        self._returns[:] = state["returns"].numpy()
        self.observation = state["observation"]

    def close(self) -> None:
        """Closes the batch."""
        self._env.close()
