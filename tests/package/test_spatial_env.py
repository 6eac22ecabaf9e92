"""The environment on the spatial model: what it has beside the planar ones, whose tests it shares."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, SnakeVectorEnv
from snake_env.testing import assert_identical


def make(num_envs=4, **options):
    return SnakeVectorEnv(num_envs, model="spatial", **{"task": "free", **options})


def run(env, steps, seed=0):
    """Results of random actions."""
    env.action_space.seed(seed)
    return [env.step(env.action_space.sample()) for _ in range(steps)]


def test_rows_do_not_depend_on_threads_or_on_the_size_of_the_batch():
    whole = make(12, task="field", num_threads=1, max_episode_steps=9)
    parted = make(12, task="field", num_threads=2, max_episode_steps=9)
    assert_identical(whole.reset(seed=3), parted.reset(seed=3), "reset")
    assert_identical(run(whole, 20), run(parted, 20), "threads")
    single = make(1, task="field", num_threads=1, max_episode_steps=9)
    whole.reset(seed=3), single.reset(seed=3)
    actions = np.random.default_rng(0).uniform(-1, 1, (8, 12, 6))
    for action in actions:
        np.testing.assert_array_equal(whole.step(action)[0][:1], single.step(action[:1])[0])


def test_a_broken_action_is_refused_by_name():
    env = make()
    env.reset(seed=0)
    actions = np.zeros((4, 6))
    actions[2, 5] = np.nan
    with pytest.raises(ConfigError, match=r"action\[2, 5\]"):
        env.step(actions)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"controller": "io"}, "controller.law"),
        ({"model": "minimal"}, "model"),
    ],
)
def test_what_the_model_has_not_is_refused(options, field):
    with pytest.raises(ConfigError) as error:
        SnakeVectorEnv(1, **{"model": "spatial", "task": "free", **options})
    assert error.value.field == field


def test_infos_tell_how_the_robot_lies():
    env = gym.make("SnakeSpatial-v1", start_jitter=0.0)
    _, info = env.reset(seed=0)
    assert info["height"] == pytest.approx(0.0525)
    assert (info["roll"], info["pitch"]) == (pytest.approx(0.0), pytest.approx(0.0))
    for _ in range(60):
        info = env.step(np.zeros(6))[4]
    assert info["height"] > 0.055
    assert 1 <= info["grounded"] < 11
    assert info["overbent"] == 0


@pytest.mark.parametrize("task", ["free", "course", "field", "perturbed", "maze", "corridor"])
@pytest.mark.parametrize("mode", ["gait", "joints", "residual"])
def test_every_task_and_mode_runs_in_space(task, mode):
    env = make(2, task=task, action_mode=mode)
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    for observation, reward, *_ in run(env, 5):
        assert observation in env.observation_space
        assert np.isfinite(reward).all()
