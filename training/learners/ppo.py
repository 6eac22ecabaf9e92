"""Proximal policy optimisation with torch, over the native batch of robots.

After Schulman et al. 2017 in the manner of CleanRL. A run whose budget is steps alone repeats itself bit for bit; where
a budget of wall time ends depends on the machine. A resumed run continues on other fields.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from snake_env.evaluation import seeds
from snake_env.policies import files
from training.config import Ppo, PpoConfig
from training.learners import behaviour_cloning, loop
from training.learners.agent import Agent, make_agent
from training.learners.collector import Collector, Rollout
from training.learning_curve import Note
from training.runs import RunFolder


def update(
    agent: Agent,
    optimiser: torch.optim.Optimizer,
    rollout: Rollout,
    targets: tuple[Tensor, Tensor],
    ppo: Ppo,
    rng: np.random.Generator,
) -> None:
    """Some epochs of gradient steps on clipped changes of probability, towards advantages and returns (T n,) each."""
    advantage, target = targets
    observation, action = rollout.observation.flatten(0, 1), rollout.action.flatten(0, 1)
    log_density = rollout.log_density.flatten()
    for _ in range(ppo.n_epochs):
        for part in batches(rng.permutation(len(target)), ppo.batch_size):
            change = agent.log_density(observation[part], action[part]) - log_density[part]
            if ppo.target_kl is not None and kl(change) > 1.5 * ppo.target_kl:
                return
            scaled = advantage[part]
            if len(scaled) > 1:  # one sample has no spread
                scaled = (scaled - scaled.mean()) / (scaled.std() + 1e-8)
            ratio = change.exp()
            clipped = ratio.clamp(1.0 - ppo.clip_range, 1.0 + ppo.clip_range)
            gain = torch.minimum(scaled * ratio, scaled * clipped).mean()
            miss = (agent.value(observation[part]) - target[part]).square().mean()
            loss = ppo.vf_coef * miss - gain - ppo.ent_coef * agent.entropy()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), ppo.max_grad_norm)
            optimiser.step()


def batches(order: NDArray[np.int64], size: int) -> list[Tensor]:
    """The order of samples cut into parts of ``size``."""
    return list(torch.from_numpy(order).split(size))


def kl(change: Tensor) -> float:
    """How far the policy has moved, from changes of log densities: an estimate that is never negative."""
    with torch.no_grad():
        return float((change.exp() - 1.0 - change).mean())


MakeCollector = Callable[[PpoConfig, int, float, Note], Any]
"""Makes a :class:`Collector`, or what stands for one on other machines."""


class Learner:
    """An agent in training: networks, optimiser and exploration noise.

    Args:
        config: of the run.
        steps: environment steps taken before; a resumed run draws other fields and noise.
        note: is told of finished episodes.
        used: share of the budget used up before.
        make: makes the collector.
    """

    checkpoint = ".pt"

    def __init__(
        self, config: PpoConfig, steps: int, note: Note, used: float = 0.0, make: MakeCollector = Collector
    ) -> None:
        self.config, self.steps = config, steps
        torch.manual_seed(config.seed)
        self.noise = torch.Generator().manual_seed(config.seed + steps)
        self.rng = np.random.default_rng([config.seed, steps])
        self.collector = make(config, seeds.training(config.seed, steps, config.num_envs), used, note)
        self.agent = make_agent(config, self.collector.observations, self.collector.actions)
        self.optimiser = torch.optim.Adam(self.agent.parameters(), eps=1e-5, fused=True)

    def collect(self) -> None:
        """Takes ``n_steps`` of each robot."""
        self.rollout, self._last_value = self.collector.collect(self.agent, self.noise, self.config.ppo.gamma)
        self.steps += self.rollout.reward.size

    def targets(self) -> tuple[Tensor, Tensor]:
        """Advantages and returns of what was collected (T n,) each."""
        return self.rollout.advantages(self._last_value, self.config.ppo)

    def learn(self, used: float) -> None:
        """Learns from what was collected; ``used`` is the share of the budget that is used up."""
        ppo = self.config.ppo
        for group in self.optimiser.param_groups:
            group["lr"] = ppo.learning_rate * (1.0 - (1.0 - ppo.final_learning_rate) * used)
        update(self.agent, self.optimiser, self.rollout, self.targets(), ppo, self.rng)
        self.collector.advance(used)

    def begin(self) -> None:
        """Imitates what the configuration names."""
        if self.config.behaviour_cloning is not None:
            behaviour_cloning.begin(self, self.config.behaviour_cloning)

    def arrays(self) -> files.Arrays:
        """What playing needs."""
        return self.agent.arrays()

    def close(self) -> None:
        """Ends the collector."""
        self.collector.close()

    def save(self, path: Path) -> None:
        """Writes a checkpoint."""
        torch.save({"agent": self.agent.state_dict(), "optimiser": self.optimiser.state_dict()}, path)

    def restore(self, path: Path) -> None:
        """Takes over networks and optimiser of a checkpoint."""
        content = torch.load(path, weights_only=True)
        self.agent.load_state_dict(content["agent"])
        self.optimiser.load_state_dict(content["optimiser"])


def train(folder: RunFolder, config: PpoConfig, show: bool = True, make: MakeCollector = Collector) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped."""
    torch.set_num_threads(config.torch_threads)
    return loop.run(folder, config, lambda steps, note, used: Learner(config, steps, note, used, make), show)
