"""Threads change how long a step takes and nothing else, and the interface adds little to it."""

from __future__ import annotations

import timeit

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, SnakeVectorEnv
from snake_env.testing import assert_identical


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_results_do_not_depend_on_the_number_of_threads(threads):
    runs = []
    for num_threads in (1, threads):
        env = gym.make_vec("SnakeField-v0", num_envs=20, num_threads=num_threads, max_episode_steps=6)
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


def test_the_interface_costs_little():
    """Measured in units of numpy.zeros(256), whose cost rises and falls with the load of the machine as well.

    About 20 units were measured, 5 to 10 us; results made anew each step would cost 100.
    """
    unit = min(timeit.repeat(lambda: np.zeros(256), number=200, repeat=50)) / 200
    assert interface_overhead() < 50 * unit


def interface_overhead():
    """Time of a step of 256 robots of which none moves [s]: checks, the call into the core, infos.

    The least mean of many runs, which disregards what else the machine does.
    """
    env = SnakeVectorEnv(256, task="course", num_threads=1)
    env.reset(seed=0)
    env._robots.everyone = np.zeros(256, np.bool_)
    actions = np.zeros((256, 4), np.float32)
    return min(timeit.repeat(lambda: env.step(actions), number=200, repeat=50)) / 200
