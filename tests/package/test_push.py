"""Pushes from outside: momentum, refused input, neighbours."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from snake_env import ConfigError


def batch(env_id="SnakeFree-v1", n=3, **options):
    envs = gymnasium.make_vec(env_id, num_envs=n, friction=(0.0, 0.0), **options)
    envs.reset(seed=0)
    return envs


def momentum(envs):
    """Of each robot (n, 2) [kg m/s]; the links of the default robot have equal masses."""
    return 7.5 * envs.unwrapped.state().link_velocity[..., :2].mean(axis=1)


@pytest.mark.parametrize("mass", [1.0, 1.1])
def test_a_push_changes_the_momentum_by_its_impulse(mass):
    """On ground without friction nothing else does."""
    envs = batch(randomization={"mass": (mass, mass)})
    action = np.zeros(envs.action_space.shape, np.float32)
    envs.step(action)
    before = momentum(envs)
    impulse = np.zeros((3, 11, 2))
    impulse[:, 4] = [[0.3, -0.2], [0.0, 0.5], [0.0, 0.0]]
    envs.unwrapped.push(impulse)
    envs.step(action)
    np.testing.assert_allclose(mass * (momentum(envs) - before), impulse.sum(axis=1), atol=1e-5)


def test_a_push_in_3d_changes_the_momentum_by_its_impulse():
    envs = batch("SnakeSpatial-v1", 1, action_mode="joints")
    action = np.zeros(envs.action_space.shape, np.float32)
    for _ in range(10):
        envs.step(action)
    before = momentum(envs)
    impulse = np.zeros((1, 11, 3))
    impulse[0, 5] = [0.0, 0.4, 0.0]
    envs.unwrapped.push(impulse)
    envs.step(action)
    np.testing.assert_allclose(momentum(envs) - before, impulse.sum(axis=1)[:, :2], atol=1e-4)


def test_a_push_leaves_other_robots_as_they_are():
    pushed, alone = batch(), batch()
    mask = np.array([False, True, False])
    pushed.unwrapped.push(np.full((11, 2), 0.05), mask)
    action = np.zeros(alone.action_space.shape, np.float32)
    found, expected = pushed.step(action)[0], alone.step(action)[0]
    np.testing.assert_array_equal(found[~mask], expected[~mask])
    assert not np.array_equal(found[mask], expected[mask])


def test_a_single_robot_and_a_robot_of_a_batch_are_pushed_alike():
    impulse = np.tile([0.02, 0.05], (11, 1))
    env = gymnasium.make("SnakeField-v1")
    env.reset(seed=0)
    env.unwrapped.push(impulse)
    envs = gymnasium.make_vec("SnakeField-v1", num_envs=1)
    envs.reset(seed=[0])
    envs.unwrapped.call("push", impulse)
    np.testing.assert_array_equal(env.step(np.zeros(4))[0], envs.step(np.zeros((1, 4)))[0][0])


@pytest.mark.parametrize(
    ("impulse", "message"),
    [
        (np.zeros((11, 3)), r"impulse = shape \(11, 3\): expected an array of shape \(3, 11, 2\) or \(11, 2\)"),
        ("hard", "impulse = 'hard'"),
        (np.full((11, 2), np.nan), r"impulse\[0, 0\] = nan: expected a finite number"),
        ("1", "impulse = '1'"),
        (True, "impulse = True"),
        (np.ones((11, 2), complex), "impulse = an array of dtype complex128"),
    ],
)
def test_impulses_that_are_refused(impulse, message):
    envs = batch()
    before = envs.unwrapped.state().link_velocity
    with pytest.raises(ConfigError, match=message):
        envs.unwrapped.push(impulse)
    np.testing.assert_array_equal(envs.unwrapped.state().link_velocity, before)
