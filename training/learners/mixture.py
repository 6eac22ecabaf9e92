"""Robots of several tasks in one batch, for one policy for all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import Any, NamedTuple, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env import ConfigError
from training.config import PpoConfig

Bools = NDArray[np.bool_]


class Part(NamedTuple):
    """The robots of one task.

    Attributes:
        name: of the task; empty where the run has only one.
        env_id: environment.
        options: its keywords.
        robots: which of the batch.
    """

    name: str
    env_id: str
    options: dict[str, Any]
    robots: slice


def parts(config: PpoConfig) -> list[Part]:
    """The tasks of a run, in the order of the robots."""
    ends = list(accumulate(config.tasks.values())) or [config.num_envs]
    return [
        Part(*environment, slice(start, end))
        for environment, start, end in zip(config.environments(), [0, *ends], ends, strict=False)
    ]


class Mixture:
    """Batches of several tasks that step as one, with automatic reset within the step.

    Args:
        of: the tasks, in the order of the robots.
        num_threads: threads of the simulator.

    Attributes:
        layout: of the first task; observations and actions are the same in all.

    Raises:
        ConfigError: the robots of two tasks observe or do different things.
    """

    def __init__(self, of: Sequence[Part], num_threads: int) -> None:
        self._parts = of
        self._envs: list[Any] = []
        for part in of:
            options = {"num_threads": num_threads, "autoreset_mode": "SameStep", **part.options}
            count = part.robots.stop - part.robots.start
            self._envs.append(cast(Any, gym.make_vec(part.env_id, num_envs=count, **options)))
        self.layout: dict[str, Any] = self._envs[0].layout
        for part, env in zip(of, self._envs, strict=True):
            if interface_of(env.layout) != interface_of(self.layout):
                raise ConfigError("tasks", part.name, f"tasks with the observations and actions of {of[0].name}")
        self.num_envs = of[-1].robots.stop
        self._names = np.array([part.name for part in of for _ in range(part.robots.stop - part.robots.start)])

    def reset(self, seed: int) -> NDArray[np.float32]:
        """First observations (n, o); robot i takes the stream ``seed + i``."""
        seen = [env.reset(seed=seed + part.robots.start)[0] for part, env in self._each()]
        return np.concatenate(seen)

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], Bools, Bools, dict[str, Any]]:
        """As :meth:`snake_env.SnakeVectorEnv.step`; infos have only what belongs to episodes that have ended."""
        stepped = [env.step(actions[part.robots]) for part, env in self._each()]
        observation, reward, terminated, truncated = (
            np.concatenate(one) for one in list(zip(*stepped, strict=True))[:4]
        )
        return observation, reward, terminated, truncated, self._ends([one[4] for one in stepped])

    def _ends(self, infos: list[dict[str, Any]]) -> dict[str, Any]:
        """Last observations and signals of the episodes that have ended, for all robots."""
        if not any("final_obs" in one for one in infos):
            return {}
        final_obs = np.full(self.num_envs, None, dtype=object)
        ended = np.zeros(self.num_envs, np.bool_)
        final: dict[str, NDArray[Any]] = {"task": self._names}
        for (part, _), one in zip(self._each(), infos, strict=True):
            if "final_obs" in one:
                final_obs[part.robots], ended[part.robots] = one["final_obs"], one["_final_obs"]
                for name, values in one["final_info"].items():
                    final.setdefault(name, np.zeros(self.num_envs, values.dtype))[part.robots] = values
        return {"final_obs": final_obs, "_final_obs": ended, "final_info": final}

    def _each(self) -> Iterator[tuple[Part, Any]]:
        return zip(self._parts, self._envs, strict=True)

    def set_difficulty(self, difficulty: float) -> None:
        """Of the episodes that begin from now on."""
        for env in self._envs:
            env.set_difficulty(difficulty)

    def get_state(self) -> list[Any]:
        """The states of all robots."""
        return [state for env in self._envs for state in env.get_state()]

    def set_state(self, states: Sequence[Any]) -> NDArray[np.float32]:
        """Replaces the states of all robots; returns their observations."""
        return np.concatenate([env.set_state(states[part.robots]) for part, env in self._each()])

    def close(self) -> None:
        """Closes the batches."""
        for env in self._envs:
            env.close()


def interface_of(layout: dict[str, Any]) -> list[Any]:
    """What has to be the same for one policy to act in two tasks."""
    seen = [tuple(block[key] for key in ("name", "elements", "mirror", "memory")) for block in layout["observation"]]
    done = [tuple(entry[key] for key in ("name", "low", "high", "mirror")) for entry in layout["action"]]
    return [seen, done]
