"""Episodes of a policy on given fields, one robot per field."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env.evaluation.movement import Movement
from snake_env.policies.interface import Policy, acting
from snake_env.vector_env import refuse_others

Episodes = dict[str, NDArray[Any]]
"""Of each episode (n,): signals of its last step; ``return``, its sum of rewards; the means of :data:`MEANS`; and of
:mod:`snake_env.evaluation.movement` ``contact_free_progress`` [m] and ``chatter``."""

MEANS = ("self_contact_force",)
"""Signals of single steps, of which an episode has the mean over its steps under the name ``mean_<signal>``."""

SHORTEST_DISTANCE = 0.01
"""Distances below this count as it in the environment's cost of transport [m]."""


def make_env(env_id: str, num_envs: int, num_threads: int | None = None, **options: Any) -> Any:
    """A batch with automatic reset.

    Raises:
        ConfigError: the id is another package's, or an option is not admissible.
    """
    refuse_others(env_id)
    return gym.make_vec(env_id, num_envs=num_envs, num_threads=num_threads, autoreset_mode="NextStep", **options)


def layout_of(env_id: str, options: dict[str, Any]) -> dict[str, Any]:
    """What the elements of an environment's observations and actions are; see ``SnakeVectorEnv.layout``."""
    env = make_env(env_id, 1, 1, **options)
    found: dict[str, Any] = env.unwrapped.layout
    env.close()
    return found


def run_episodes(
    policy: Policy, env_id: str, seeds: list[int], num_threads: int | None = None, **options: Any
) -> Episodes:
    """Plays the first episode of each seed to its end.

    Args:
        policy: acts for all robots at once.
        env_id: environment.
        seeds: one per robot.
        num_threads: threads of the simulator; None: the environment's choice.
        **options: keywords of the environment, under those of the policy.
    """
    env = make_env(env_id, len(seeds), num_threads, **acting(policy, options))
    policy.begin(env.unwrapped.layout, len(seeds))
    episodes, _ = play(env, policy, seeds)
    env.close()
    return episodes


def play(env: Any, act: Callable[[NDArray[np.float32]], NDArray[np.float32]], seeds: list[int]) -> tuple[Episodes, int]:
    """Plays the first episode of each seed in a batch of as many robots, and the steps of the batch this took."""
    observation, _ = env.reset(seed=seeds)
    running, steps = np.ones(len(seeds), np.bool_), 0
    movement = Movement(len(seeds), float(env.unwrapped.layout["control_period"]))
    last: Episodes = {name: np.zeros(len(seeds)) for name in ("return", *(f"mean_{signal}" for signal in MEANS))}
    while running.any():
        action = act(observation)
        observation, reward, terminated, truncated, infos = env.step(action)
        steps += 1
        movement.note(action, infos, running)
        last["return"][running] += reward[running]
        for signal in MEANS:
            mean = last[f"mean_{signal}"]
            mean[running] += (infos[signal][running] - mean[running]) / steps
        ended = running & (terminated | truncated)
        if ended.any():
            chatter = np.array([movement.chatter(robot) if end else 0.0 for robot, end in enumerate(ended)])
            moved = {"contact_free_progress": movement.contact_free_progress, "chatter": chatter}
            _note(last, infos | moved, ended)
        running &= ~ended
    return last, steps


def _note(last: Episodes, infos: dict[str, Any], ended: NDArray[np.bool_]) -> None:
    """Keeps the signals of the episodes that have just ended."""
    for name, values in infos.items():
        if not name.startswith("_"):
            last.setdefault(name, np.zeros_like(values))[ended] = values[ended]


def energy_over_weight(episodes: Episodes) -> NDArray[np.float64]:
    """Positive actuator work over the robot's weight, episode by episode [m]."""
    return episodes["cost_of_transport"] * np.maximum(np.abs(episodes["distance"]), SHORTEST_DISTANCE)
