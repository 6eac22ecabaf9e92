"""The batch in learners of other packages, by their own checkers and runners."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError


@pytest.mark.parametrize("mode", ["SameStep", "Disabled"])
def test_torchrl_takes_a_batch_as_it_is(mode):
    envs = pytest.importorskip("torchrl.envs")
    robots = gym.make_vec("SnakeField-v1", num_envs=3, autoreset_mode=mode, max_episode_steps=6, num_threads=1)
    assert robots.unwrapped.autoreset_mode.value == mode
    env = envs.GymWrapper(robots)
    envs.check_env_specs(env, seed=0)
    rollout = env.rollout(15, break_when_any_done=False)
    assert rollout["next", "truncated"].sum() == 2 * 3
    assert rollout["next", "truncated"][:, [5, 11]].all()
    first, last = rollout["observation"][:, 6], rollout["next", "observation"][:, 5]
    assert not np.allclose(first, last), "an episode ends with its own last observation"


@pytest.fixture
def adapter():
    pytest.importorskip("rsl_rl.env")
    from snake_env import rsl_rl

    return rsl_rl


def test_rsl_rl_sees_the_steps_of_the_batch(adapter):
    import torch

    env = adapter.make("SnakeField-v1", 3, seed=5, privileged=True, max_episode_steps=4, num_threads=1)
    robots = gym.make_vec(
        "SnakeField-v1", 3, privileged=True, max_episode_steps=4, num_threads=1, autoreset_mode="SameStep"
    )
    observation, _ = robots.reset(seed=5)
    sensed = next(b["start"] for b in robots.unwrapped.layout["observation"] if b["name"].startswith("privileged_"))
    assert (env.num_envs, env.num_actions, env.max_episode_length) == (3, 4, 4)
    for k in range(1, 10):
        groups = env.get_observations()
        np.testing.assert_array_equal(groups["critic"], observation)
        np.testing.assert_array_equal(groups["policy"], observation[:, :sensed])
        action = np.full((3, 4), 0.1 * k, np.float32)
        observation, reward, terminated, truncated, infos = robots.step(action)
        _, rewards, dones, extras = env.step(torch.from_numpy(action))
        np.testing.assert_allclose(rewards, reward, rtol=1e-6)
        np.testing.assert_array_equal(dones, terminated | truncated)
        np.testing.assert_array_equal(extras["time_outs"], truncated & ~terminated)
        assert env.episode_length_buf.tolist() == [k % 4] * 3
        assert ("log" in extras) == (k % 4 == 0)
        if k % 4 == 0:
            assert extras["log"]["/episode/speed"] == pytest.approx(infos["final_info"]["speed"].mean())


def test_rsl_rl_hears_of_time_limits_only(adapter):
    import torch

    def first(state, action, previous_action):
        return np.arange(len(action)) == 0

    env = adapter.make("SnakeField-v1", 2, termination_fn=first, max_episode_steps=1)
    *_, dones, extras = env.step(torch.zeros(2, 4))
    assert dones.tolist() == [1, 1]
    assert extras["time_outs"].tolist() == [False, True]


def test_rsl_rl_refuses_a_batch_that_restarts_otherwise(adapter):
    envs = gym.make_vec("SnakeField-v1", 2, autoreset_mode="NextStep")
    with pytest.raises(ConfigError, match=r'autoreset_mode = NextStep: expected "SameStep", the only mode of rsl_rl'):
        adapter.RslRlEnv(envs)
    envs.close()


def test_rsl_rl_learns_from_a_batch(adapter):
    runners = pytest.importorskip("rsl_rl.runners")
    env = adapter.make("SnakeField-v1", 4, seed=0, max_episode_steps=8, num_threads=1)
    network = {"class_name": "MLPModel", "hidden_dims": [16, 16], "activation": "tanh"}
    gaussian = {"class_name": "GaussianDistribution", "init_std": 0.5}
    config = {
        "num_steps_per_env": 8,
        "save_interval": 100,
        "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
        "algorithm": {"class_name": "PPO", "num_learning_epochs": 1, "num_mini_batches": 2},
        "actor": network | {"distribution_cfg": gaussian},
        "critic": dict(network),
    }
    runner = runners.OnPolicyRunner(env, config, None, "cpu")
    before = [value.clone() for value in runner.alg.actor.parameters()]
    runner.learn(2, init_at_random_ep_len=True)
    assert any((one != other).any() for one, other in zip(before, runner.alg.actor.parameters(), strict=True))
