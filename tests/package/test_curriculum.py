"""Difficulty that changes while environments run, and robots that differ from each other."""

from __future__ import annotations

import copy

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, Noise, Randomization, SnakeEnv, SnakeVectorEnv
from snake_env.testing import assert_identical


def after_reset(env, seed=4):
    return env.reset(seed=seed)[0]


def test_a_new_difficulty_counts_from_the_next_reset_on():
    env, hard = SnakeVectorEnv(3, task="field"), SnakeVectorEnv(3, task="field", difficulty=1.0)
    before = after_reset(env)
    env.set_difficulty(1.0)
    action = np.zeros((3, 4), np.float32)
    same = SnakeVectorEnv(3, task="field")
    assert_identical(before, after_reset(same), "the episode that runs")
    assert_identical(env.step(action), same.step(action), "its next step")
    assert_identical(after_reset(env), after_reset(hard), "the next episode")


def test_each_robot_may_have_a_difficulty_of_its_own():
    env = SnakeVectorEnv(3, task="field")
    env.set_difficulty([0.0, 0.5, 1.0])
    env.set_difficulty(0.25, np.array([False, True, False]))
    rows = [after_reset(SnakeEnv(task="field", difficulty=d), 4 + i) for i, d in enumerate([0.0, 0.25, 1.0])]
    assert_identical(after_reset(env), np.stack(rows), "robots of different difficulty")


def test_single_environments_and_copies_have_it_too():
    env = gym.make("SnakeField-v1")
    env.unwrapped.set_difficulty(0.9)
    expected = after_reset(SnakeEnv(task="field", difficulty=0.9))
    assert_identical(after_reset(env), expected, "a single environment")
    batch = SnakeVectorEnv(1, task="field")
    batch.set_difficulty(0.9)
    assert_identical(after_reset(copy.deepcopy(batch))[0], expected, "a copy")


def test_a_callback_of_stable_baselines_reaches_it():
    sb3 = pytest.importorskip("snake_env.sb3")
    env = sb3.make("SnakeField-v1", 3)
    env.env_method("set_difficulty", 1.0, indices=[1])
    env.seed(4)
    rows = [after_reset(SnakeEnv(task="field", difficulty=d), 4 + i) for i, d in enumerate([0.5, 1.0, 0.5])]
    assert_identical(env.reset(), np.stack(rows), "the robot that was addressed")


@pytest.mark.parametrize(
    "difficulty", [-0.1, 1.1, float("nan"), "hard", [0.1, 0.2], [0.1], "0.5", True, None, [True] * 3]
)
def test_a_difficulty_out_of_range_is_named(difficulty):
    with pytest.raises(ConfigError, match=r"^difficulty = "):
        SnakeVectorEnv(3, task="field").set_difficulty(difficulty)


def test_what_is_randomised_differs_between_episodes():
    options = {"task": "free", "start_jitter": 0.0}
    weak = SnakeVectorEnv(4, **options, randomization={"torque_limit": (0.05, 1.0)})
    noisy = SnakeVectorEnv(4, **options, randomization={"noise": Noise(joint_angle=0.1)})
    plain = SnakeVectorEnv(4, **options)
    assert np.ptp(after_reset(noisy)[:, 0]) > 0.0
    action = np.tile(np.array([1.0, 1.0, 0.0, 0.0], np.float32), (4, 1))
    for env in (weak, plain):
        env.reset(seed=0)
        for _ in range(20):
            infos = env.step(action)[4]
        assert (np.ptp(infos["energy"]) > 0.0) == (env is weak)


@pytest.mark.parametrize(
    ("keywords", "field"),
    [
        ({"friction": (1.0, 0.5)}, "friction"),
        ({"mass": (0.0, 1.0)}, "mass"),
        ({"torque_limit": (1.0, float("inf"))}, r"torque_limit(\[1\])?"),
        ({"reference_rate": 0.0}, "reference_rate"),
        ({"reference_delay": (0.1, 0.05)}, "reference_delay"),
        ({"noise": {"position": -1.0}}, r"noise\.position"),
        ({"peg_error": -0.1}, "peg_error"),
        ({"backlash": (0.1, 0.05)}, "backlash"),
        ({"backlash": (0.0, 2.0)}, "backlash"),
        ({"stribeck": (0.5, 1.5)}, "stribeck"),
    ],
)
def test_ranges_are_checked_by_name(keywords, field):
    with pytest.raises(ConfigError, match=rf"^randomization\.{field} = "):
        Randomization(**keywords)


def test_what_depends_on_the_environment_is_checked_there():
    with pytest.raises(ConfigError, match=r"^randomization\.reference_rate = "):
        SnakeEnv(task="field", randomization=Randomization(reference_rate=30.0))
