"""Environments whose joints are under input-output linearisation."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import snake_env
import snake_env.sb3
from snake_env import IOLinearizing, SnakeVectorEnv
from snake_env.registration import TASKS
from snake_env.testing import check_vector_env

# The spatial model has no input-output linearisation.
IDS = [name for name, options in TASKS.items() if "model" not in options]


@pytest.mark.parametrize("name", IDS)
def test_every_checker_passes(name):
    single = gym.make(name, controller="io", max_episode_steps=6)
    check_env(single.unwrapped, skip_render_check=True)
    check_vector_env(
        lambda **given: gym.make_vec(name, controller="io", max_episode_steps=6, **given).unwrapped,
        lambda: gym.make(name, controller="io", max_episode_steps=6),
        steps=10,
    )


def test_by_name_the_gains_come_from_the_control_period():
    by_name = SnakeVectorEnv(2, task="course", controller="io")
    gains = IOLinearizing.for_period(0.005, torque_limit=10.0, treatment="implicit")
    explicit = SnakeVectorEnv(2, task="course", controller=gains)
    law = {"law": "io", "kp": 2500.0, "kd": 100.0, "torque_limit": 10.0, "active_from": 0.0}
    mapping = SnakeVectorEnv(2, task="course", controller=law)
    observations = []
    for env in (by_name, explicit, mapping):
        env.reset(seed=0)
        for _ in range(5):
            observation, *_ = env.step(np.full(env.action_space.shape, 0.3, np.float32))
        observations.append(observation)
    np.testing.assert_array_equal(observations[0], observations[1])
    np.testing.assert_array_equal(observations[0], observations[2])


def test_other_names_and_treatments_are_refused():
    with pytest.raises(snake_env.ConfigError, match="controller = 'pid'"):
        SnakeVectorEnv(1, controller="pid")
    with pytest.raises(snake_env.ConfigError, match=r"controller\.treatment"):
        SnakeVectorEnv(1, controller=IOLinearizing.for_period(0.01))
    with pytest.raises(snake_env.ConfigError, match="control_period"):
        SnakeVectorEnv(1, controller="io", control_period="short")


def effort(controller, name, random):
    """Linear solves in all, and the worst residual."""
    env = gym.make_vec(name, num_envs=32, controller=controller)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    solves = residual = 0.0
    for _ in range(40):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape) * float(random)
        _, _, _, _, info = env.step(action.astype(np.float32))
        assert not info["unconverged"].any()
        solves += info["iterations"].sum()
        residual = max(residual, info["residual"].max())
    return solves, residual


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("random", [False, True])
def test_it_takes_at_most_half_as_much_again_as_pd(name, random):
    """Counted in linear solves, which take most of a step; the inverse dynamics of a stage cost about half of one."""
    (pd, _), (io, residual) = (effort(controller, name, random) for controller in ("pd", "io"))
    assert io < 1.35 * pd, io / pd
    assert residual < 1e-4


def test_it_trains():
    sb3 = pytest.importorskip("stable_baselines3")
    venv = snake_env.sb3.make("SnakeFree-v1", num_envs=8, controller="io")
    model = sb3.PPO("MlpPolicy", venv, n_steps=32, batch_size=64, n_epochs=2, seed=0).learn(1024)
    assert model.num_timesteps >= 1024
    venv.close()
