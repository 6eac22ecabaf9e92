"""Behaviour cloning: an agent begins as a scripted controller or as a policy trained before.

A configuration with a section ``behaviour_cloning`` begins like this, before the first update of PPO. The agent acts,
and the actor learns by least squares what the controller would have done; the samples of all rounds are kept (DAgger;
Ross, Gordon and Bagnell 2011), so that the actor learns the right action where its own mistakes lead to. Labels are
exact, since the controller has the same observations. A run of several tasks may have a policy trained before as the
teacher in each of them. From one policy trained before, the weights are copied. Then only the critic learns: an
untrained critic would undo in a few updates what was cloned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from snake_env import ConfigError
from snake_env.evaluation.rollout import layout_of
from snake_env.policies import files
from snake_env.policies.interface import INTERFACE
from snake_env.policies.loading import load_policy
from snake_env.policies.memory import network_inputs, time_constants
from snake_env.policies.ranges import Conversion, planar_name
from snake_env.policies.scripted import catalogue
from snake_env.policies.shipped import policy_path
from training.config import BehaviourCloning
from training.learners.mixture import Part, parts

WAVE_ACTIONS = 4
"""Actions of mode ``gait``; mode ``residual`` has them first, and the offsets of joints after them."""

LEARNING_RATE = 1e-3
BATCH = 1024


class Expert:
    """A scripted controller, tuned for a task, in the learner's action mode.

    Args:
        cloning: which controller.
        layout: of the learner's environment.
        num_envs: robots.

    Raises:
        ConfigError: the controller acts in a mode whose actions the learner does not have.
    """

    def __init__(self, cloning: BehaviourCloning, layout: dict[str, Any], num_envs: int) -> None:
        self._controller = catalogue.tuned(str(cloning.controller), str(cloning.task))
        modes = {"gait": ("gait", "residual"), "residual": ("residual",), "joints": ("joints",)}
        mode = _action_mode(layout)
        if mode not in modes[self._controller.mode]:
            raise ConfigError("behaviour_cloning.controller", cloning.controller, f"one that acts by {mode} or by gait")
        self._observations = sum(block["size"] for block in layout["observation"])
        self._actions = len(layout["action"])
        known = WAVE_ACTIONS if self._controller.mode == "gait" else self._actions
        self._controller.begin({**layout, "action": layout["action"][:known]}, num_envs)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a); zero where the controller has none. It does not observe the learner's memory."""
        action = self._controller(observation[:, : self._observations])
        return np.pad(action, ((0, 0), (0, self._actions - action.shape[1])))

    def forget(self, rows: NDArray[np.bool_]) -> None:
        """The robots in ``rows`` begin an episode."""
        self._controller.reset(rows)


class Teachers:
    """Trained policies, each the expert of the robots of one task, which observe what the learner's robots observe.

    A teacher gets those elements of the learner's observation that it was trained on, by name, and has a memory of its
    own along the learner's trajectories.

    Args:
        policies: by task its policy, a shipped one or a file.
        of: the tasks of the learner.

    Raises:
        ConfigError: a teacher observes or does what the learner does not.
    """

    def __init__(self, policies: Mapping[str, str], of: Sequence[Part]) -> None:
        self._teachers = [_Teacher(policies[part.name], part) for part in of]

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a)."""
        return np.concatenate([teacher(observation[teacher.robots]) for teacher in self._teachers])

    def forget(self, rows: NDArray[np.bool_]) -> None:
        """The robots in ``rows`` begin an episode."""
        for teacher in self._teachers:
            teacher.policy.reset(rows[teacher.robots])


class _Teacher:
    """A trained policy as the expert of the robots of one task."""

    def __init__(self, name: str, part: Part) -> None:
        self.policy, self.robots = load_policy(name), part.robots
        of_task = {key: value for key, value in part.options.items() if key not in INTERFACE}
        own, theirs = (layout_of(part.env_id, of) for of in (part.options, of_task | self.policy.env_options))
        self.policy.begin(theirs, part.robots.stop - part.robots.start)
        seen = network_inputs(own, ())
        self._sees = _matches(network_inputs(theirs, ()), seen)
        if -1 in self._sees or done(own) != done(theirs):
            options = ", ".join(f"{key} {value}" for key, value in self.policy.env_options.items())
            raise ConfigError("behaviour_cloning.teachers", name, f"one that acts as the learner does, not {options}")

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions for the learner's observations, whose first elements are those of the environment."""
        return np.clip(self.policy(observation[:, self._sees]), -1.0, 1.0)


def _action_mode(layout: dict[str, Any]) -> str:
    """By the number of actions: only the wave, only joints, or both."""
    joints = next(block["size"] for block in layout["observation"] if block["name"] == "joint_angle")
    return {WAVE_ACTIONS: "gait", joints: "joints"}.get(len(layout["action"]), "residual")


def begin(learner: Any, cloning: BehaviourCloning) -> None:
    """Gives the agent of a :class:`training.learners.ppo.Learner` what ``cloning`` names, then warms its critic up."""
    layout = layout_of(learner.config.env_id, learner.config.env)
    if cloning.policy is not None:
        seen = layout_of(learner.config.env_id, learner.config.acting_env)
        take_over(learner.agent, seen, learner.config.policy.memory, policy_path(cloning.policy))
    if cloning.teachers:
        imitate(learner, Teachers(cloning.teachers, parts(learner.config)), cloning)
    elif cloning.controller is not None:
        imitate(learner, Expert(cloning, layout, learner.config.num_envs), cloning)
    for _ in range(cloning.critic_rounds):
        learner.collect()
        _, target = learner.targets()
        observation, target = (one.flatten(0, 1) for one in (learner.rollout.observation, target))
        fit(learner.agent.critic, observation, target[:, None], cloning.epochs, learner.rng)


def take_over(agent: Any, layout: dict[str, Any], times: Sequence[float], path: Path) -> None:
    """Gives the actor the weights of a policy file, input by input and output by output of the same name.

    The file's policy may have other inputs and actions: those that only it has are left out; those that only the agent
    has get zero weights, and as actions the value zero.

    Args:
        agent: a :class:`training.learners.ppo.Agent`.
        layout: of its environment.
        times: of its traces [s].
        path: the file.

    Raises:
        ConfigError: there is no such file, it cannot be read, or its hidden layers are not the agent's.
    """
    if not path.is_file():
        raise ConfigError("behaviour_cloning.policy", path, "the policy.safetensors of a run")
    try:
        arrays, run = files.read(path)
    except ValueError as error:
        raise ConfigError("behaviour_cloning.policy", path, "a file that training wrote") from error
    own = {name: array for name, array in agent.arrays().items() if name.startswith("actor.")}
    hidden, expected = (
        [len(those[name]) for name in sorted(own) if name.endswith("bias")][:-1]
        for those in ({name: arrays.get(name, np.zeros(0)) for name in own}, own)
    )
    if hidden != expected or f"actor.{len(expected) + 1}.bias" in arrays:
        raise ConfigError("behaviour_cloning.policy", path, f"hidden layers {expected}, found {hidden}")
    theirs = layout_of(run["env_id"], run["env"])
    seen, known = network_inputs(layout, times), network_inputs(theirs, time_constants(run))
    last = len(expected)
    for k in range(last + 1):  # the agent's arrays share their memory with its parameters
        weight, bias = arrays[f"actor.{k}.weight"], arrays[f"actor.{k}.bias"]
        if k == 0:
            scale, shift = Conversion.of(seen, layout, theirs)
            columns = _taken(weight.T, _matches(seen, known))
            weight, bias = (columns * scale[:, None]).T, bias + shift @ columns
        if k == last:
            scale, shift = Conversion.of(done(layout), layout, theirs)
            rows = _matches(done(layout), done(theirs))
            weight, bias = _taken(weight, rows) / scale[:, None], (_taken(bias, rows) - shift) / scale
        own[f"actor.{k}.weight"][...], own[f"actor.{k}.bias"][...] = weight, bias


def done(layout: dict[str, Any]) -> list[str]:
    """Names of the elements of an action."""
    return [entry["name"] for entry in layout["action"]]


def _matches(own: list[str], theirs: list[str]) -> list[int]:
    """For each name of ours its place in theirs, by its name in the planar model if need be; -1: it has none."""
    places = {name: k for k, name in enumerate(theirs)}
    return [places.get(name, places.get(planar_name(name), -1)) for name in own]


def _taken(rows: NDArray[np.float32], places: list[int]) -> NDArray[np.float32]:
    """The rows at these places; zero at -1."""
    return np.stack([rows[k] if k >= 0 else np.zeros_like(rows[0]) for k in places])


def imitate(learner: Any, expert: Expert | Teachers, cloning: BehaviourCloning) -> None:
    """Trains the actor on an expert's actions along the actor's own trajectories (DAgger)."""
    seen, taught = [], []
    for _ in range(cloning.rounds):
        learner.collect()
        observation = learner.rollout.observation
        seen.append(observation.flatten(0, 1).clone())
        taught.append(labels(expert, observation, learner.rollout.done))
        missed = fit(learner.agent.actor, torch.cat(seen), torch.cat(taught), cloning.epochs, learner.rng)
        print(f"imitation, {learner.steps} steps: mean squared error {missed:.4f}", flush=True)


def labels(expert: Expert | Teachers, observation: Tensor, done: NDArray[np.bool_]) -> Tensor:
    """What the expert would have done (T n, a) along rollouts (T, n, o), from one to the next."""
    taught = []
    for seen, ended in zip(observation.numpy(), done, strict=True):
        taught.append(torch.from_numpy(expert(seen)))
        expert.forget(ended)
    return torch.cat(taught)


def fit(network: nn.Module, inputs: Tensor, outputs: Tensor, epochs: int, rng: np.random.Generator) -> float:
    """Least squares by Adam; returns the mean squared error of the last epoch."""
    optimiser = torch.optim.Adam(network.parameters(), LEARNING_RATE)
    for _ in range(epochs):
        errors = []
        for part in torch.from_numpy(rng.permutation(len(inputs))).split(BATCH):
            loss = (network(inputs[part]) - outputs[part]).square().mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            errors.append(loss.item())
    return float(np.mean(errors))
