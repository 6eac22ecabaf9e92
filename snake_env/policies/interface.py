"""What a policy is to an environment: actions for a batch of observations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env.errors import ConfigError
from snake_env.options import TaskOptions
from snake_env.policies import files
from snake_env.policies.policy_card import PolicyCard
from snake_env.registration import CONTROL_PERIOD, MAX_EPISODE_STEPS, OWN_ID, TASKS

INTERFACE = ("action_mode", "perception", "nearest_pegs", "observation_blocks", "privileged", "control_period")
"""Keywords of the environment that belong to a policy; all others belong to the task on which it is evaluated."""

OF_A_TASK = frozenset([*TaskOptions.__annotations__, "max_episode_steps"])
"""Keywords of a task."""


def title(path: Path) -> str:
    """Name of a trained policy in tables: that of its file or, where all runs call it the same, of its run."""
    return path.parent.name if path.name in (files.NAME, "model.zip") else path.stem


class Policy(Protocol):
    """Actions for a batch of robots, from observations only; scripted and learned policies observe the same."""

    name: str
    env_options: dict[str, Any]
    """Keywords of the environment that the policy needs, such as its action mode."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes; ``layout`` is the environment's."""
        ...

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,), whose next observation begins an episode."""
        ...

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a) in [-1, 1] for observations (n, o)."""
        ...


class Stateless:
    """A policy that remembers nothing."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Has nothing to prepare."""

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Has nothing to forget."""


class PolicyBase(Stateless):
    """A policy with a card, and the environment that the card names.

    Args:
        card: what it is, where it was trained and how it scored.
    """

    def __init__(self, card: PolicyCard) -> None:
        self.name, self.card = card.name, card
        self.env_options = interface(card.env_options)

    def make_vec(self, num_envs: int = 1, **options: Any) -> gym.vector.VectorEnv:
        """The environment in which the policy was trained, as a native batch; fields of pegs if it is unknown.

        Episodes restart in the step in which they end, unless ``autoreset_mode`` says otherwise; hand
        ``terminated | truncated`` to :meth:`reset`.

        Args:
            num_envs: Robots.
            **options: Keywords of the environment that override those of the training.

        Raises:
            ConfigError: the file names an environment that is not one of this package's, or a keyword that is not
                admissible.
        """
        env_id, trained = named_task(
            "SnakeField-v1" if self.card.env_id is None else self.card.env_id, self.card.env_options
        )
        return gym.make_vec(env_id, num_envs=num_envs, **{"autoreset_mode": "SameStep"} | trained | options)

    def begin_as_trained(self, num_envs: int) -> None:
        """Prepares for a batch of new episodes in the environment in which the policy was trained."""
        env: Any = self.make_vec(1, num_threads=1)
        self.begin(env.unwrapped.layout, num_envs)
        env.close()

    def require_inputs(self, shown: int, sees: int) -> None:
        """Refuses observations of another size than the policy takes.

        Raises:
            ConfigError: names both sizes.
        """
        if sees != shown:
            expected = f"a policy with {shown} inputs, as this environment provides; this one has {sees}"
            raise ConfigError("policy", self.name, f"{expected} ({', '.join(INTERFACE)} as in its training)")


def interface(options: Mapping[str, Any]) -> dict[str, Any]:
    """Those of an environment's keywords that belong to a policy."""
    return {name: value for name, value in options.items() if name in INTERFACE}


def acting(policy: Policy, options: Mapping[str, Any]) -> dict[str, Any]:
    """Keywords of the environment in which a policy acts on a task with ``options``.

    A policy with a control period of its own has as many seconds as the others, not as many steps.
    """
    keywords = {**options, **policy.env_options}
    ratio = options.get("control_period", CONTROL_PERIOD) / keywords.get("control_period", CONTROL_PERIOD)
    if ratio != 1.0:
        keywords["max_episode_steps"] = max(1, round(options.get("max_episode_steps", MAX_EPISODE_STEPS) * ratio))
    return keywords


def task_keywords(spec: Any, *more: str) -> dict[str, Any]:
    """Those of a spec's keywords that belong to the task, and the length of episodes; and ``more``."""
    found = {name: value for name, value in spec.kwargs.items() if name in OF_A_TASK or name in more}
    if spec.max_episode_steps in (None, MAX_EPISODE_STEPS):
        return found
    return {"max_episode_steps": spec.max_episode_steps} | found  # of a single environment, whose wrapper ends episodes


def named_task(env_id: str, options: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """The environment and keywords that a file names, whose author need not be trusted.

    Raises:
        ConfigError: the id is not one that this package registers, since making another runs its code; or a keyword
            does not belong to the task.
    """
    if env_id not in TASKS:
        raise ConfigError("env_id", repr(env_id), OWN_ID)
    for name, value in options.items():
        if name not in OF_A_TASK:
            raise ConfigError(f"env.{name}", repr(value), "a keyword of a task")
    return env_id, options


def refuse_other_interface(policy: Policy, options: Mapping[str, Any]) -> None:
    """Refuses keywords of an environment that differ from those with which a policy acts.

    Raises:
        ConfigError: names the keyword.
    """
    for name in INTERFACE:
        own = policy.env_options.get(name)
        if own is not None and _plain(options.get(name, own)) != _plain(own):
            raise ConfigError(f"options.{name}", options[name], f"{own}, which {policy.name} acts with")


def _plain(value: Any) -> Any:
    """Names of blocks as JSON has them."""
    return list(value) if isinstance(value, tuple) else value
