"""Threads change how long a step takes and nothing else, and the interface does nothing per robot."""

from __future__ import annotations

import sys

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, SnakeVectorEnv
from snake_env.testing import assert_identical


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_results_do_not_depend_on_the_number_of_threads(threads):
    runs = []
    for num_threads in (1, threads):
        env = gym.make_vec("SnakeField-v1", num_envs=20, num_threads=num_threads, max_episode_steps=6)
        env.action_space.seed(0)
        runs.append([env.reset(seed=0)] + [env.step(env.action_space.sample()) for _ in range(15)])
    assert_identical(*runs, f"1 and {threads} threads")


def test_num_threads_follows_argument_then_variable_then_cores(monkeypatch):
    monkeypatch.setenv("SNAKE_ENV_NUM_THREADS", "3")
    assert SnakeVectorEnv(64).num_threads == 3
    assert SnakeVectorEnv(64, num_threads=2).num_threads == 2
    monkeypatch.setenv("SNAKE_ENV_NUM_THREADS", "many")
    with pytest.raises(ConfigError, match="SNAKE_ENV_NUM_THREADS = 'many'"):
        SnakeVectorEnv(64)
    monkeypatch.delenv("SNAKE_ENV_NUM_THREADS")
    monkeypatch.setattr("snake_env._threads.cores", lambda: 4)
    assert [SnakeVectorEnv(n).num_threads for n in (1, 8, 9, 17, 1000)] == [1, 1, 2, 3, 4]


def test_a_step_calls_few_functions_whatever_the_number_of_robots():
    """The interface does per step what it does, and nothing per robot: 11 calls of Python and 6 of C were counted."""
    few, many = (calls_of_a_step(num_envs) for num_envs in (8, 256))
    assert few == many
    assert 1 < many <= 25


def calls_of_a_step(num_envs):
    """Calls of Python and C functions in a step during which no episode ends."""
    env = SnakeVectorEnv(num_envs, task="course", num_threads=1)
    env.reset(seed=0)
    actions = np.zeros((num_envs, 4), np.float32)
    env.step(actions)
    events = []
    sys.setprofile(lambda frame, event, argument: events.append(event))
    env.step(actions)
    sys.setprofile(None)
    return sum(event in ("call", "c_call") for event in events)
