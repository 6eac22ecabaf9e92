"""The benchmark's protocol for any policy: test scenes, scores, intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._checks import integer
from snake_env.errors import ConfigError
from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.rollout import Episodes, run_episodes
from snake_env.evaluation.scores import Row, against, score, table
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.interface import INTERFACE, Policy, Stateless

SCENES = 500
"""Test scenes of the benchmark."""

Act = Callable[[NDArray[np.float32]], NDArray[np.float32]]


@dataclass(frozen=True)
class Evaluation:
    """How a policy scores; ``print`` shows the table.

    Attributes:
        name: of the policy.
        task: where it was played.
        scores: by name, as "success" and "speed"; each has ``value``, and ``low`` and ``high`` of its 95 % bootstrap
            interval over scenes.
        episodes: the last ``info`` of every episode, (n,) arrays by name, and ``return``.
    """

    name: str
    task: BenchmarkTask
    scores: Row
    episodes: Episodes

    def against(self, other: Evaluation) -> Row:
        """Differences in success, progress [m] and speed [m/s] to another policy, scene by scene, with their intervals.

        Raises:
            ConfigError: the two were played elsewhere, or on other numbers of scenes.
        """
        if self.task != other.task or len(self.episodes["time"]) != len(other.episodes["time"]):
            mine, its = (f"{one.task.name} on {len(one.episodes['time'])} scenes" for one in (self, other))
            raise ConfigError("other", its, f"an evaluation of {mine}")
        return against(self.episodes, other.episodes)

    def __str__(self) -> str:
        return table({self.name: self.scores})


def evaluate(
    policy: Policy | Act,
    task: str | BenchmarkTask = "field-hard",
    *,
    scenes: int = SCENES,
    name: str | None = None,
    env_options: Mapping[str, Any] | None = None,
    num_threads: int | None = None,
    precision: str | None = None,
) -> Evaluation:
    """Plays a policy on test scenes, which neither training nor selection may use, one episode on each.

    Args:
        policy: from :func:`snake_env.load_policy`, any other :class:`snake_env.policies.Policy`, or a function of
            observations (n, o) that returns actions (n, a) for n robots at once.
        task: name of a task of the benchmark, or a :class:`BenchmarkTask` of your own.
        scenes: number of scenes, >= 1; the same ones for every policy.
        name: of the policy in the table; None: its own.
        env_options: what a function needs of the environment: ``action_mode``, ``perception``, ``nearest_pegs`` and
            ``control_period``. Everything else belongs to the task.
        num_threads: threads of the simulator; None: the environment's choice.
        precision: "fast", "default" or "fine": how accurate the time stepping is; None: the task's.

    Raises:
        ConfigError: the task, an option or the number of scenes is not admissible.
    """
    if isinstance(task, str):
        (task,) = tasks.chosen([task])
    count = integer("scenes", scenes, 1, len(seeds.HELD_OUT))
    player = _player(policy, dict(env_options or {}))
    options = task.options if precision is None else {**task.options, "precision": precision}
    episodes = run_episodes(player, task.env_id, seeds.held_out(count), num_threads, **options)
    return Evaluation(name or player.name, task, score(episodes), episodes)


def _player(policy: Any, env_options: dict[str, Any]) -> Policy:
    """The policy itself, or a function as a policy."""
    for key, value in env_options.items():
        if key not in INTERFACE:
            expected = f"one of {', '.join(INTERFACE)}; others are the task's"
            raise ConfigError(f"env_options[{key!r}]", repr(value), expected)
    if not hasattr(policy, "begin"):
        return _Function(policy, env_options)
    missing = [part for part in ("name", "env_options", "reset") if not hasattr(policy, part)]
    if missing:
        expected = "name, env_options, begin and reset, as snake_env.policies.Policy describes them, or a function"
        raise ConfigError("policy", f"{type(policy).__name__} without {', '.join(missing)}", expected)
    if env_options:
        raise ConfigError("env_options", repr(env_options), "none, the policy has its own")
    played: Policy = policy
    return played


class _Function(Stateless):
    """A function of observations as a policy."""

    def __init__(self, act: Any, env_options: dict[str, Any]) -> None:
        if not callable(act):
            raise ConfigError("policy", repr(act), "a policy, or a function of observations")
        self.name = getattr(act, "__name__", type(act).__name__)
        self.env_options = env_options
        self._act = act

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        return self._act(observation)
