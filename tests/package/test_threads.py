"""Threads change how long a step takes and nothing else, and the interface does nothing per robot."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import gymnasium as gym
import numpy as np
import pytest

import snake_env
from snake_env import Batch, ConfigError, SnakeVectorEnv
from snake_env.testing import assert_identical


@pytest.mark.parametrize("threads", [2, 3, 7])
@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_results_do_not_depend_on_the_number_of_threads(model, threads):
    runs = []
    for num_threads in (1, threads):
        env = gym.make_vec("SnakeField-v1", num_envs=20, model=model, num_threads=num_threads, max_episode_steps=6)
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


def run_of(kind):
    """Positions of robots that a thread of Python steps by itself, in one of four ways."""
    if kind == "simulate":
        return snake_env.simulate(duration=1.0).position
    if kind == "batch":
        batch = Batch(20, num_threads=2)
        batch.command[:] = 0.3
        batch.step(20)
        return batch.state["link_position"]
    env = SnakeVectorEnv(20, num_threads=2, **({"model": "spatial"} if kind == "spatial" else {}))
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.full(env.action_space.shape, 0.5))
    return env.state().link_position


def test_threads_with_robots_of_their_own_do_not_notice_each_other():
    kinds = ["planar", "spatial", "batch", "simulate"] * 2
    alone = {kind: run_of(kind) for kind in set(kinds)}
    with ThreadPoolExecutor(len(kinds)) as threads:
        for kind, together in zip(kinds, threads.map(run_of, kinds), strict=True):
            np.testing.assert_array_equal(together, alone[kind], err_msg=kind)


def calls_of_threads(call, threads=4, times=60):
    """How many of the calls of threads at once succeed, and the messages of those that are refused."""
    begin = threading.Barrier(threads)

    def work(_):
        begin.wait()
        messages = []
        for _ in range(times):
            try:
                call()
            except RuntimeError as error:
                messages.append(str(error))
        return messages

    with ThreadPoolExecutor(threads) as pool:
        refused = [message for messages in pool.map(work, range(threads)) for message in messages]
    return threads * times - len(refused), refused


@pytest.mark.parametrize("num_threads", [1, 2])
def test_an_environment_that_threads_share_steps_or_refuses(num_threads):
    """A call beside another one is refused by name; those that are not count once each."""
    env, twin = (SnakeVectorEnv(48, num_threads=num_threads, autoreset_mode="Disabled") for _ in range(2))
    for one in (env, twin):
        one.reset(seed=0)
    actions = np.full(env.action_space.shape, 0.1)
    taken, refused = calls_of_threads(lambda: env.step(actions))
    assert refused
    assert set(refused) <= {"Already borrowed", "Already mutably borrowed"}
    for _ in range(taken):
        twin.step(actions)
    assert_identical([env.state().arrays()], [twin.state().arrays()], "shared and alone")


def test_a_batch_that_threads_share_steps_or_refuses():
    batch = Batch(48)
    # Long enough that a busy machine, too, lets another thread call meanwhile.
    taken, refused = calls_of_threads(lambda: batch.step(10))
    assert taken > 0
    assert refused
    assert set(refused) <= {"Already borrowed", "Already mutably borrowed"}
    batch.reset(seed=0)
    batch.command[:] = 0.2
    batch.step(3)
    other = Batch(48)
    other.command[:] = 0.2
    other.step(3)
    np.testing.assert_array_equal(batch.state["link_position"], other.state["link_position"])
