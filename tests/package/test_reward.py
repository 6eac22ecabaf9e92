"""The reward is the sum of its terms, or what a function of the caller makes of the signals."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError


def test_reward_terms_add_up_to_the_reward(env_id):
    env = gym.make_vec(env_id, num_envs=3, goal_distance=0.1, goal_radius=0.05)
    _, infos = env.reset(seed=0)
    env.action_space.seed(0)
    terms = [name for name in infos if name.startswith("reward_")]
    assert len(terms) == 4
    for _ in range(40):
        actions = env.action_space.sample()
        _, reward, _, _, infos = env.step(actions)
        np.testing.assert_allclose(reward, sum(infos[name] for name in terms), atol=1e-12)


def test_the_reward_can_be_replaced(make):
    seen = []

    def reward_fn(signals, action, previous_action):
        seen.append((action.copy(), previous_action.copy()))
        return signals["distance"] - 0.5 * np.square(action - previous_action).sum(axis=1)

    env = make(num_envs=3, reward_fn=reward_fn)
    single = gym.make("SnakeField-v0", max_episode_steps=9, reward_fn=reward_fn)
    env.reset(seed=4)
    single.reset(seed=4)
    env.action_space.seed(0)
    previous = np.zeros((3, 4), np.float32)
    for _ in range(9):
        actions = env.action_space.sample()
        seen.clear()
        _, reward, _, _, infos = env.step(actions)
        np.testing.assert_array_equal(seen[0][0], actions)
        np.testing.assert_array_equal(seen[0][1], previous)
        change = 0.5 * np.square(actions - previous).sum(axis=1)
        np.testing.assert_allclose(reward, infos["distance"] - change, rtol=1e-6)
        assert single.step(actions[0])[1] == reward[0]
        previous = actions
    seen.clear()
    _, reward, *_ = env.step(actions)
    assert not reward.any()
    assert seen[0][0].shape == (0, 4)
    env.step(actions)
    assert not seen[-1][1].any()


def test_a_reward_of_the_wrong_shape_is_named(make):
    env = make(num_envs=3, reward_fn=lambda signals, action, previous_action: 0.0)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"reward_fn = rewards of shape \(\): expected shape \(3,\)"):
        env.step(np.zeros((3, 4)))
