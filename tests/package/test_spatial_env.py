"""The environment on the spatial model: what it has beside the planar ones, whose tests it shares."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, SnakeVectorEnv


def make(num_envs=4, **options):
    return SnakeVectorEnv(num_envs, model="spatial", **{"task": "free", **options})


def run(env, steps, seed=0):
    """Results of random actions."""
    env.action_space.seed(seed)
    return [env.step(env.action_space.sample()) for _ in range(steps)]


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
