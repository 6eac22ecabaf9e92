"""Proximal policy optimisation in one file, over the native batch: torch, NumPy and this package, nothing else.

    python -m training.learners.ppo --out runs/field --config field-hard --seed 0 --seconds 1500

After Schulman et al. 2017 in the manner of CleanRL: read it from top to bottom. It takes the configurations of
``training.learners.sb3`` and leaves the same folder, with ``policy.safetensors`` in the place of ``model.zip``. A run
whose budget is steps alone repeats itself bit for bit; a budget of wall time ends where the machine's speed has it
end. ``--resume`` goes on from the latest checkpoint, on fresh fields. Ctrl-C saves and stops.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

import snake_env  # noqa: F401
from training import run_command, seeds
from training.budget import Budget, StopRequest
from training.config import Config, Policy, Ppo
from training.learners import behaviour_cloning
from training.learning_curve import SIGNALS, LearningCurve, text
from training.policies import files, memory, symmetry
from training.policies.memory import Traces, observed
from training.rollout import layout_of
from training.runs import RunFolder

LOG_SQRT_TAU = 0.5 * float(np.log(2.0 * np.pi))
POLICY = files.NAME
ROLLOUT = ("observation", "action", "log_density", "value", "reward", "done")
"""Arrays of a :class:`Rollout`."""


class Agent(nn.Module):
    """Actor and critic: two networks with tanh, and a Gaussian whose spread does not depend on the observation.

    Args:
        observations: elements of an observation.
        actions: elements of an action.
        policy: hidden layers, their precision, and the standard deviation at the start.
        sides: makes both networks treat left and right alike.
    """

    def __init__(self, observations: int, actions: int, policy: Policy, sides: symmetry.Mirror | None) -> None:
        super().__init__()
        self.actor: nn.Module = network(observations, policy, actions, last_gain=0.01)
        self.critic: nn.Module = network(observations, policy, 1, last_gain=1.0)
        if sides is not None:
            self.actor = symmetry.Mirrored(self.actor, sides.observation, sides.action)
            self.critic = symmetry.Mirrored(self.critic, sides.observation, np.ones(1, np.float32))
        self._sides = sides
        self.log_std = nn.Parameter(torch.full((actions,), policy.log_std))

    def value(self, observation: Tensor) -> Tensor:
        """Expected discounted return (n,)."""
        return self.critic(observation).squeeze(-1)

    def act(self, observation: Tensor, noise: torch.Generator) -> tuple[Tensor, Tensor]:
        """Random actions (n, a) and the logarithm of their density (n,)."""
        mean = self.actor(observation)
        deviation = torch.empty_like(mean).normal_(generator=noise)
        return mean + deviation * self.log_std.exp(), self._log_density(deviation)

    def log_density(self, observation: Tensor, action: Tensor) -> Tensor:
        """Logarithm of the density of given actions (n,)."""
        return self._log_density((action - self.actor(observation)) * (-self.log_std).exp())

    def _log_density(self, deviation: Tensor) -> Tensor:
        """Of a deviation from the mean in standard deviations."""
        return -(0.5 * deviation.square() + self.log_std + LOG_SQRT_TAU).sum(-1)

    def entropy(self) -> Tensor:
        """Of the Gaussian."""
        return (self.log_std + 0.5 + LOG_SQRT_TAU).sum()

    def arrays(self) -> files.Arrays:
        """What playing needs: the actor's layers, numbered without the tanh between them, and the mirror's signs."""
        layers = [layer for layer in self.actor.modules() if isinstance(layer, nn.Linear)]
        named = {
            f"actor.{k}.{name}": value for k, layer in enumerate(layers) for name, value in layer.named_parameters()
        }
        signs = {} if self._sides is None else self._sides.arrays()
        return {name: value.detach().numpy() for name, value in named.items()} | signs


def make_agent(config: Config, observations: int, actions: int) -> Agent:
    """The agent of a run before it has learned anything."""
    return Agent(observations, actions, config.policy, mirror_of(config))


def mirror_of(config: Config) -> symmetry.Mirror | None:
    """The mirror of a run's environment and of its traces; None where the run does without."""
    if not config.policy.mirror:
        return None
    layout = layout_of(config.env_id, config.env)
    sides = symmetry.Mirror.of(layout)
    remembered = np.tile(sides.observation[memory.remembered(layout)], len(config.policy.traces))
    return symmetry.Mirror(np.concatenate([sides.observation, remembered]), sides.action)


def network(inputs: int, policy: Policy, outputs: int, last_gain: float) -> nn.Sequential:
    """Hidden layers with tanh, in the precision that the policy learns in, and a last one that is linear."""
    sizes = pairwise([inputs, *policy.hidden])
    layers = [layer for wide, high in sizes for layer in (linear(wide, high, 2.0**0.5), nn.Tanh())]
    hidden = HalfPrecision(*layers) if policy.bfloat16 else nn.Sequential(*layers)
    return nn.Sequential(hidden, linear([inputs, *policy.hidden][-1], outputs, last_gain))


def linear(inputs: int, outputs: int, gain: float) -> nn.Linear:
    """A layer with orthogonal weights and zero biases."""
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


class HalfPrecision(nn.Sequential):
    """Layers whose products are of bfloat16 numbers; what they leave is in single precision again."""

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs (n, k)."""
        with torch.autocast("cpu", torch.bfloat16):
            return cast(Tensor, super().forward(inputs)).float()


class Rollout:
    """What n robots have lived through in T steps; every array begins with (T, n).

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
        """Generalised advantages (Schulman et al. 2016) and the returns they imply, (T n,) each."""
        value = self.value.numpy()
        advantage = np.zeros_like(value)
        following, next_value = np.zeros_like(value[0]), last_value.numpy()
        for t in reversed(range(len(value))):
            goes_on = 1.0 - self.done[t]
            error = self.reward[t] + ppo.gamma * goes_on * next_value - value[t]
            following = error + ppo.gamma * ppo.gae_lambda * goes_on * following
            advantage[t], next_value = following, value[t]
        return torch.from_numpy(advantage).flatten(), torch.from_numpy(advantage + value).flatten()


Note = Callable[[float, Mapping[str, Any]], None]
"""Takes note of a finished episode: the sum of its rewards, the signals of its last step."""


class Collector:
    """Robots that act by the agent, start anew by themselves, and report their finished episodes.

    Args:
        config: of the run.
        seed: of the first robot's fields; the others take the seeds after it.
        used: share of the training budget used up before.
        note: is told of finished episodes.
    """

    def __init__(self, config: Config, seed: int, used: float, note: Note) -> None:
        options = {"num_threads": config.num_threads, "autoreset_mode": "SameStep", **config.env}
        self._env = cast(Any, gym.make_vec(config.env_id, num_envs=config.num_envs, **options))
        layout = self._env.layout
        self._traces = Traces(layout, config.policy.traces, config.num_envs)
        self.observations = len(observed(layout, config.policy.traces))
        self.actions = len(layout["action"])
        self._hardest = float(layout["config"]["difficulty"])
        self.rollout = Rollout(config.ppo.n_steps, config.num_envs, self.observations, self.actions)
        self._note = note
        self._returns = np.zeros(config.num_envs)
        self._config = config
        self.advance(used)
        self.observation = torch.from_numpy(self._traces(self._env.reset(seed=seed)[0]))

    def advance(self, used: float) -> None:
        """Sets the difficulty of the episodes that begin from now on; ``used`` is the share of the budget used up."""
        if self._config.curriculum:
            self._env.set_difficulty(self._config.difficulty(used, self._hardest))

    @torch.no_grad()
    def collect(self, agent: Agent, noise: torch.Generator, gamma: float) -> tuple[Rollout, Tensor]:
        """Fills the rollout with fresh steps; also returns the value of what comes after them (n,)."""
        rollout = self.rollout
        for t in range(len(rollout.reward)):
            rollout.observation[t] = self.observation
            rollout.action[t], rollout.log_density[t] = agent.act(self.observation, noise)
            observation, reward, terminated, truncated, infos = self._env.step(rollout.action[t].numpy())
            self._returns += reward
            rollout.reward[t], rollout.done[t] = reward, terminated | truncated
            if "final_obs" in infos:
                self._note_ends(infos)
                cut = np.flatnonzero(truncated & ~terminated)
                if len(cut):  # time was up: what would have come counts as the critic sees it
                    last = self._traces.foresee(np.stack(infos["final_obs"][cut]), cut)
                    rollout.reward[t, cut] += gamma * agent.value(torch.from_numpy(last)).numpy()
                self._traces.forget(rollout.done[t])
            self.observation = torch.from_numpy(self._traces(observation))
        rollout.value[:] = agent.value(rollout.observation)
        return rollout, agent.value(self.observation)

    def _note_ends(self, infos: dict[str, Any]) -> None:
        for i in np.flatnonzero(infos["_final_obs"]):
            self._note(self._returns[i], {name: infos["final_info"][name][i] for name in SIGNALS})
            self._returns[i] = 0.0

    def close(self) -> None:
        """Closes the batch."""
        self._env.close()


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


MakeCollector = Callable[[Config, int, float, Note], Any]
"""Makes a :class:`Collector`, or what stands for one on other machines."""


class Learner:
    """An agent in training: networks, optimiser and the noise that explores.

    Args:
        config: of the run.
        steps: environment steps taken before; a resumed run draws other fields and noise.
        note: is told of finished episodes.
        used: share of the budget used up before.
        make: makes the collector.
    """

    def __init__(
        self, config: Config, steps: int, note: Note, used: float = 0.0, make: MakeCollector = Collector
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
        """Becomes what the configuration has it begin as."""
        if self.config.clone is not None:
            behaviour_cloning.begin(self, self.config.clone)

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


def train(folder: RunFolder, config: Config, show: bool = True, make: MakeCollector = Collector) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped.

    Raises:
        ConfigError: the run would begin with a configuration that is for evolution.
    """
    if folder.latest() is None:
        config.refuse_evolution("training.learners.ppo")
    torch.set_num_threads(config.torch_threads)
    return run(folder, config, lambda steps, note, used: Learner(config, steps, note, used, make), show)


def run(folder: RunFolder, config: Config, make: Callable[[int, Note, float], Any], show: bool) -> int:
    """Trains a learner that ``make`` makes of the steps taken before, of what takes note of finished episodes, and of
    the share of the budget used up before; 130 when it was stopped.
    """
    checkpoint = folder.latest()
    steps = 0 if checkpoint is None else int(checkpoint.stem)
    budget = Budget(config.total_steps, config.max_minutes, 0.0 if checkpoint is None else folder.seconds(checkpoint))
    budget.note(steps)
    curve = LearningCurve(budget, steps)
    learner = make(steps, curve.note, budget.used)
    if checkpoint is None:
        learner.begin()
    else:
        with folder.resumed():
            learner.restore(checkpoint)
    with StopRequest() as stop:
        work(learner, folder, budget, curve, stop, show)
    folder.save_checkpoint(learner.save, learner.steps, budget.seconds)
    files.write(folder.model, learner.arrays(), config.to_mapping() | {"steps": learner.steps})
    learner.close()
    if stop.received:
        print(f"saved after {learner.steps} steps")
        return 130
    folder.finish({"steps": learner.steps, "seconds": round(budget.seconds, 1)})
    if show:
        print(f"{learner.steps} steps in {budget.seconds:.0f} s: {folder.model}")
    return 0


def work(learner: Any, folder: RunFolder, budget: Budget, curve: LearningCurve, stop: StopRequest, show: bool) -> None:
    """Collects and learns in turn until the budget is used up."""
    saved = shown = budget.seconds
    while budget.used < 1.0 and not stop.received:
        learner.collect()
        budget.note(learner.steps)
        row = curve.row(learner.steps)
        folder.append_curve(row)
        learner.learn(budget.used)
        if budget.seconds - saved >= learner.config.checkpoint_seconds:
            folder.save_checkpoint(learner.save, learner.steps, budget.seconds)
            saved = budget.seconds
        if show and budget.seconds - shown >= SHOW_SECONDS:
            print(f"{100.0 * budget.used:3.0f} %  {text(row)}", flush=True)
            shown = budget.seconds


SHOW_SECONDS = 5.0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    return run_command.parser("training.learners.ppo", __doc__)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget has been used up, 130 when it was stopped."""
    args = parser().parse_args(arguments)
    return run_command.run(args, RunFolder(args.out, POLICY, ".pt"), train)


if __name__ == "__main__":
    sys.exit(main())
