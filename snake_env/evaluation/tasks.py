"""The tasks of the benchmark, from ``tasks.json``, and which policy acts in which."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import gymnasium as gym

from snake_env import robot_classes
from snake_env.errors import ConfigError
from snake_env.policies.foreign import Function, Model
from snake_env.policies.interface import INTERFACE, Policy, named_task, refuse_other_interface, task_keywords
from snake_env.policies.loading import load_policy
from snake_env.policies.network import Network, Scaling
from snake_env.policies.sb3_zip import scaling
from snake_env.policies.wrappers import normalization_of, spec_of
from snake_env.registration import TASKS

FILE = Path(__file__).with_name("tasks.json")
GOAL = 2.0
"""Distance of the goal by default [m]."""


@dataclass(frozen=True)
class BenchmarkTask:
    """An environment that policies are compared in.

    Args:
        name: in tables and files.
        env_id: environment.
        options: its keywords; those a policy needs, such as its action mode, come on top.
        about: one line for people.
        suite: tasks over which policies are compared together; by default those of the robot's model.
    """

    name: str
    env_id: str
    options: dict[str, Any] = field(default_factory=dict)
    about: str = ""
    suite: str = ""

    @property
    def model(self) -> str:
        """Of the robot: "planar" or "spatial"."""
        return model_of(self.env_id, self.options)


def model_of(env_id: str, options: Mapping[str, Any]) -> str:
    """The robot's model in an environment with these keywords."""
    return str(options.get("model", gym.spec(env_id).kwargs.get("model", "planar")))


def load(path: Path = FILE) -> dict[str, BenchmarkTask]:
    """All tasks of a file, by name, in its order."""
    content = json.loads(path.read_text())
    return {
        name: BenchmarkTask(name, entry["env"], entry.get("options", {}), entry["about"], entry.get("suite", ""))
        for name, entry in content.items()
    }


def chosen(names: Sequence[str] | None, path: Path = FILE) -> list[BenchmarkTask]:
    """The tasks of these names; None: all.

    Raises:
        ConfigError: a name that the file does not have.
    """
    known = load(path)
    for name in names or []:
        if name not in known:
            raise ConfigError("task", name, f"one of {', '.join(known)}")
    return [known[name] for name in names or known]


def judged(task: BenchmarkTask, robot_class: str | None = None) -> BenchmarkTask:
    """The task in a class of robot, None: its own, with the keywords that evaluations in this class have.

    Raises:
        ConfigError: there is no such class.
    """
    of_class = {} if robot_class is None else {"robot_class": robot_class}
    options = task.options | of_class
    name = options.get("robot_class")
    own = {} if name is None else robot_classes.of(name).get("judged", {})
    return replace(task, options=own | options)


def acting_in(
    policy: Any, env: Any = None, default: str = "field-medium", options: Mapping[str, Any] | None = None, **how: Any
) -> tuple[Policy, BenchmarkTask]:
    """Who acts, and where.

    Args:
        policy: as :func:`snake_env.load_policy` takes it.
        env: name of a task of the benchmark; id of an environment; an environment, single or batch, made with this
            package, whose ``VecNormalize`` scales for a model or zip without statistics of its own; a
            :class:`BenchmarkTask`; None: where the policy was trained, as far as that is known.
        default: task of a policy whose training is unknown.
        options: keywords of the environment, on top of those of ``env``.
        **how: keywords of :func:`snake_env.load_policy`.

    Raises:
        ConfigError: there is no such policy or task, they do not fit each other, or another wrapper of ``env`` changes
            observations or actions.
    """
    known = load()
    name = env.name if isinstance(env, BenchmarkTask) else default if env is None else env
    scales = None if env is None or isinstance(env, str | BenchmarkTask) else normalization_of(env)
    actor = load_policy(policy, task=name if isinstance(name, str) and name in known else None, **how)
    if scales is not None and how.get("normalize") is None:
        _scale(actor, policy, scales)
    task = _of(env, getattr(actor, "card", None), known, default)
    task = replace(task, options={**task.options, **(options or {})})
    refuse_other_interface(actor, task.options)
    return actor, task


def _of(env: Any, card: Any, known: dict[str, BenchmarkTask], default: str) -> BenchmarkTask:
    if isinstance(env, BenchmarkTask):
        return env
    if env is None and card is not None and card.env_id is not None:
        env_id, options = named_task(card.env_id, card.scored_options)
        own = {key: value for key, value in options.items() if key not in INTERFACE}
        return BenchmarkTask(card.name, env_id, own, card.about)
    if env is None or isinstance(env, str):
        name = default if env is None else env
        if name not in known and name not in TASKS:
            expected = f"one of {', '.join(known)}, or an id: {', '.join(TASKS)}"
            raise ConfigError("env_id" if "-v" in name else "task", name, expected)
        return known.get(name) or BenchmarkTask(name, name)
    spec = spec_of(env)
    if spec is None or spec.id not in TASKS:
        raise ConfigError("env", repr(env), "an environment of this package")
    return BenchmarkTask(spec.id, spec.id, task_keywords(spec, "reward_fn", "termination_fn"))


def _scale(actor: Policy, policy: Any, scales: Any) -> None:
    """Gives a model or zip without statistics those of a ``VecNormalize``; others know unscaled observations.

    Raises:
        ConfigError: which of both a function expects is unknown.
    """
    if isinstance(actor, Model):
        actor.scale_as(scales)
    elif isinstance(actor, Network) and actor.scaling is None and str(policy).endswith(".zip"):
        rms = scales.obs_rms
        actor.scaling = Scaling(*scaling(rms.mean, rms.var, scales.epsilon, scales.clip_obs).values())
    elif isinstance(actor, Function):
        expected = f"False for {actor.name}, which is called with observations that VecNormalize has not scaled"
        raise ConfigError("normalize", None, expected)
