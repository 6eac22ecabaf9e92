"""Proximal policy optimisation with torch, over the native batch of robots.

After Schulman et al. 2017 in the manner of CleanRL. A run repeats itself bit for bit on the same kind of processor,
also when it was stopped and resumed: a checkpoint has robots and random states beside networks and optimiser.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from snake_env.evaluation import seeds
from snake_env.policies import files
from training.config import Ppo, PpoConfig, load_as
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
) -> dict[str, float]:
    """Some epochs of gradient steps on clipped changes of probability, towards advantages and returns (T n,) each.

    Returns:
        Diagnostics under the names of Stable-Baselines3, means over the gradient steps.
    """
    advantage, target = targets
    observation, action = rollout.observation.flatten(0, 1), rollout.action.flatten(0, 1)
    log_density = rollout.log_density.flatten()
    noted: list[Tensor] = []
    for _ in range(ppo.n_epochs):
        for part in batches(rng.permutation(len(target)), ppo.batch_size):
            change = agent.log_density(observation[part], action[part]) - log_density[part]
            moved = kl(change)
            if ppo.target_kl is not None and moved > 1.5 * ppo.target_kl:
                return diagnostics(noted, rollout, target, agent)
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
            norm = nn.utils.clip_grad_norm_(agent.parameters(), ppo.max_grad_norm)
            optimiser.step()
            beyond = ((ratio.detach() - 1.0).abs() > ppo.clip_range).float().mean()
            noted.append(torch.stack([loss.detach(), -gain.detach(), miss.detach(), moved, beyond, norm]))
    return diagnostics(noted, rollout, target, agent)


NOTED = ("loss", "policy_gradient_loss", "value_loss", "approx_kl", "clip_fraction", "grad_norm")
"""What is noted of each gradient step."""


def diagnostics(noted: list[Tensor], rollout: Rollout, target: Tensor, agent: Agent) -> dict[str, float]:
    """Means over the gradient steps of an update, and what the critic explained of the returns before it."""
    means = torch.stack(noted).mean(0).tolist() if noted else [float("nan")] * len(NOTED)
    spread = float(target.var())
    missed = float((target - rollout.value.flatten()).var())
    found = dict(zip(NOTED, means, strict=True)) | {
        "entropy_loss": -float(agent.entropy().detach()),
        "explained_variance": 1.0 - missed / spread if spread > 0.0 else float("nan"),
        "std": float(agent.log_std.detach().exp().mean()),
        "gradient_steps": float(len(noted)),
    }
    return {f"train/{name}": value for name, value in found.items()}


def batches(order: NDArray[np.int64], size: int) -> list[Tensor]:
    """The order of samples cut into parts of ``size``."""
    return list(torch.from_numpy(order).split(size))


def kl(change: Tensor) -> Tensor:
    """How far the policy has moved, from changes of log densities: an estimate that is never negative."""
    with torch.no_grad():
        return (change.exp() - 1.0 - change).mean()


MakeCollector = Callable[[PpoConfig, int, float, Note], Any]
"""Makes a :class:`Collector`, or what stands for one on other machines."""


class Learner:
    """An agent in training: networks, optimiser and exploration noise.

    Args:
        config: of the run.
        steps: environment steps taken before.
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
        self.noise = torch.Generator().manual_seed(config.seed)
        self.rng = np.random.default_rng(config.seed)
        self.collector = make(config, seeds.training(config.seed, 0, config.num_envs), used, note)
        self.agent = make_agent(config, self.collector.observations, self.collector.actions)
        self.optimiser = torch.optim.Adam(self.agent.parameters(), eps=1e-5, fused=True)

    def collect(self) -> None:
        """Takes ``n_steps`` of each robot."""
        self.rollout, self._last_value = self.collector.collect(self.agent, self.noise, self.config.ppo.gamma)
        self.steps += self.rollout.reward.size

    @property
    def simulator_seconds(self) -> float:
        """Wall time spent in the simulator so far [s]."""
        return float(self.collector.simulator_seconds)

    def targets(self) -> tuple[Tensor, Tensor]:
        """Advantages and returns of what was collected (T n,) each."""
        return self.rollout.advantages(self._last_value, self.config.ppo)

    def learn(self, used: float) -> dict[str, float]:
        """Learns from what was collected; ``used`` is the share of the budget that is used up."""
        ppo = self.config.ppo
        rate = ppo.learning_rate * (1.0 - (1.0 - ppo.final_learning_rate) * used)
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        found = update(self.agent, self.optimiser, self.rollout, self.targets(), ppo, self.rng)
        self.collector.advance(used)
        return found | {"train/learning_rate": rate}

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

    def save(self, path: Path, curve: dict[str, Any]) -> None:
        """Writes a checkpoint."""
        content = {
            "agent": self.agent.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "noise": self.noise.get_state(),
            "rng": json.dumps(self.rng.bit_generator.state),
            "robots": self.collector.state(),
            "curve": curve,
        }
        torch.save(content, path)

    def restore(self, path: Path) -> dict[str, Any]:
        """Takes over networks, optimiser, robots and random states of a checkpoint; returns the learning curve's."""
        content = torch.load(path, weights_only=True)
        self.agent.load_state_dict(content["agent"])
        self.optimiser.load_state_dict(content["optimiser"])
        self.noise.set_state(content["noise"])
        self.rng.bit_generator.state = json.loads(content["rng"])
        self.collector.restore(content["robots"])
        curve: dict[str, Any] = content["curve"]
        return curve


def train(folder: RunFolder, config: PpoConfig, show: bool = True, make: MakeCollector = Collector) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped.

    A configuration that the run begins from is trained first, in a folder of its own inside.
    """
    torch.set_num_threads(config.torch_threads)
    learned = config
    cloning = config.behaviour_cloning
    if cloning is not None and cloning.run is not None:
        before = RunFolder(folder.path / "before")
        if not before.finished and (status := train(before, _before(before, config, cloning.run), show, make)) != 0:
            return status
        learned = config.with_changes(behaviour_cloning=cloning.with_changes(run=None, policy=str(before.policy)))
    return loop.run(folder, config, lambda steps, note, used: Learner(learned, steps, note, used, make), show)


def _before(folder: RunFolder, config: PpoConfig, name: str) -> PpoConfig:
    """The configuration of the run that another begins from; it has begun when this returns."""
    loose = {field: getattr(config, field) for field in ("seed", "num_threads", "torch_threads", "track")}
    found = load_as(PpoConfig, name).with_changes(**loose)
    folder.create(found)
    return found
