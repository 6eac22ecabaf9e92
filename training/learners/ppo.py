"""Proximal policy optimisation with torch, over the native batch of robots.

After Schulman et al. 2017 in the manner of CleanRL. A run repeats itself bit for bit on the same kind of processor,
also when it was stopped and resumed: a checkpoint has robots and random states beside networks and optimiser.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from snake_env.evaluation import seeds
from snake_env.policies import files
from training.config import Ppo, PpoConfig, load_as
from training.learners import behaviour_cloning, loop
from training.learners.agent import Agent, make_agent
from training.learners.clipped_adam import ClippedAdam
from training.learners.collector import Collector, Rollout
from training.learning_curve import Note
from training.runs import RunFolder


def update(
    agent: Agent,
    optimiser: ClippedAdam,
    rollout: Rollout,
    targets: tuple[Tensor, Tensor],
    ppo: Ppo,
    rng: np.random.Generator,
) -> dict[str, float]:
    """Some epochs of gradient steps on the clipped surrogate objective, the error of the critic and the entropy.

    Args:
        agent: learns.
        optimiser: of its parameters.
        rollout: what the robots did.
        targets: advantages and returns of it (T, n) each.
        ppo: settings.
        rng: orders the samples.

    Returns:
        Diagnostics under the names of Stable-Baselines3, means over the gradient steps.
    """
    samples, noted = Samples(rollout, targets), list[Tensor]()
    for _ in range(ppo.n_epochs):
        for part in batches(rng.permutation(len(samples)), ppo.batch_size):
            loss, terms = losses(agent, samples.minibatch(part), ppo)
            if ppo.target_kl is not None and terms["approx_kl"] > 1.5 * ppo.target_kl:
                return diagnostics(noted, rollout, targets[1], agent)
            loss.backward()
            terms["grad_norm"] = optimiser.step(ppo.max_grad_norm)
            noted.append(torch.stack([terms[name].detach() for name in NOTED]))
    return diagnostics(noted, rollout, targets[1], agent)


class Minibatch(NamedTuple):
    """Samples of a gradient step.

    Attributes:
        observation: (k, o).
        action: (k, a).
        log_prob: Logarithm of the density of the action under the policy that took it (k,).
        returns: (k,).
        advantages: Standardised (k,).
        share: Of a sample in the gradient.
    """

    observation: Tensor
    action: Tensor
    log_prob: Tensor
    returns: Tensor
    advantages: Tensor
    share: float


class Samples:
    """The T n samples of a rollout, in one array so that a minibatch is gathered at once.

    Args:
        rollout: Of all robots.
        targets: Advantages and returns of it (T, n) each.
    """

    def __init__(self, rollout: Rollout, targets: tuple[Tensor, Tensor]) -> None:
        advantages, returns = targets
        self._advantages = advantages.flatten()
        columns = (
            rollout.observation,
            rollout.action,
            rollout.log_density[..., None],
            returns.view_as(rollout.value)[..., None],
        )
        self._samples, self._widths = torch.cat(columns, -1).flatten(0, 1), [one.shape[-1] for one in columns]

    def __len__(self) -> int:
        """Number of samples."""
        return len(self._advantages)

    def minibatch(self, part: Tensor) -> Minibatch:
        """The samples with the indices ``part``."""
        observation, action, log_prob, returns = self._samples.index_select(0, part).split(self._widths, -1)
        advantages = standardised(self._advantages.index_select(0, part))
        return Minibatch(observation, action, log_prob[:, 0], returns[:, 0], advantages, 1.0 / len(part))


def losses(agent: Agent, batch: Minibatch, ppo: Ppo) -> tuple[Tensor, dict[str, Tensor]]:
    """The loss of a gradient step, and its terms and diagnostics by the names in :data:`NOTED`.

    Args:
        agent: Learns.
        batch: Samples.
        ppo: Settings.
    """
    log_prob, value = agent(batch.observation, batch.action)
    log_ratio = log_prob - batch.log_prob
    ratio = log_ratio.exp()
    with torch.no_grad():  # an estimate of the divergence that is never negative
        approx_kl = (ratio - 1.0 - log_ratio).sum() * batch.share
    clipped = ratio.clamp(1.0 - ppo.clip_range, 1.0 + ppo.clip_range)
    policy_loss = -torch.minimum(batch.advantages * ratio, batch.advantages * clipped).sum() * batch.share
    value_loss = (value - batch.returns).square().sum() * batch.share
    loss = policy_loss + ppo.vf_coef * value_loss - ppo.ent_coef * agent.entropy()
    return loss, {
        "loss": loss,
        "policy_gradient_loss": policy_loss,
        "value_loss": value_loss,
        "approx_kl": approx_kl,
        "clip_fraction": (clipped != ratio).sum() * batch.share,
    }


NOTED = ("loss", "policy_gradient_loss", "value_loss", "approx_kl", "clip_fraction", "grad_norm")
"""What is noted of each gradient step."""


def diagnostics(noted: list[Tensor], rollout: Rollout, returns: Tensor, agent: Agent) -> dict[str, float]:
    """Means over the gradient steps of an update, and what the critic explained of the returns before it."""
    means = torch.stack(noted).mean(0).tolist() if noted else [float("nan")] * len(NOTED)
    returns = returns.view_as(rollout.value)
    spread, missed = float(returns.var()), float((returns - rollout.value).var())
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


def standardised(values: Tensor) -> Tensor:
    """With mean zero and deviation one; a single value has no spread and stays."""
    if len(values) == 1:
        return values
    deviation, mean = torch.std_mean(values)
    return (values - mean) / (deviation + 1e-8)


class Learner:
    """An agent in training: networks, optimiser and exploration noise.

    Args:
        config: of the run.
        steps: environment steps taken before.
        note: receives the finished episodes.
        used: share of the budget used up before.
    """

    checkpoint = ".pt"

    def __init__(self, config: PpoConfig, steps: int, note: Note, used: float = 0.0) -> None:
        self.config, self.steps = config, steps
        torch.manual_seed(config.seed)
        self.noise = torch.Generator().manual_seed(config.seed)
        self.rng = np.random.default_rng(config.seed)
        self.collector = Collector(config, seeds.training(config.seed, 0, config.num_envs), used, note)
        self.agent = make_agent(config, self.collector.observations, self.collector.actions)
        self.optimiser = ClippedAdam(self.agent)

    def collect(self) -> None:
        """Takes ``n_steps`` of each robot."""
        self.rollout, self._last_value = self.collector.collect(self.agent, self.noise, self.config.ppo.gamma)
        self.steps += self.config.ppo.n_steps * self.config.num_envs

    @property
    def simulator_seconds(self) -> float:
        """Wall time spent in the simulator so far [s]."""
        return float(self.collector.simulator_seconds)

    def targets(self) -> tuple[Tensor, Tensor]:
        """Advantages and returns of what was collected (T, n) each."""
        return self.rollout.advantages(self._last_value, self.config.ppo)

    def learn(self, used: float) -> dict[str, float]:
        """Learns from what was collected; ``used`` is the share of the budget that is used up."""
        ppo = self.config.ppo
        rate = ppo.learning_rate * (1.0 - (1.0 - ppo.final_learning_rate) * used)
        self.optimiser.rate = rate
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


def train(folder: RunFolder, config: PpoConfig, show: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped.

    A configuration that the run begins from is trained first, in a folder of its own inside.
    """
    torch.set_num_threads(config.torch_threads)
    learned = config
    cloning = config.behaviour_cloning
    if cloning is not None and cloning.run is not None:
        before = RunFolder(folder.path / "before")
        if not before.finished and (status := train(before, _before(before, config, cloning.run), show)) != 0:
            return status
        learned = config.with_changes(behaviour_cloning=cloning.with_changes(run=None, policy=str(before.policy)))

    def begin(steps: int, note: Note, used: float) -> Learner:
        return Learner(learned, steps, note, used)

    return loop.run(folder, config, begin, show)


def _before(folder: RunFolder, config: PpoConfig, name: str) -> PpoConfig:
    """The configuration of the run that another begins from; it has begun when this returns."""
    loose = {field: getattr(config, field) for field in ("seed", "num_threads", "torch_threads", "track")}
    found = load_as(PpoConfig, name).with_changes(**loose)
    folder.create(found)
    return found
