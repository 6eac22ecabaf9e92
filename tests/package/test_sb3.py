"""The Stable-Baselines3 VecEnv over the native batch."""

from __future__ import annotations

import warnings

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
    VecVideoRecorder,
)

import snake_env.sb3
from snake_env import ConfigError
from snake_env.registration import TASKS
from snake_env.testing import assert_identical

torch.set_num_threads(1)


def small(algorithm, env, **keywords):
    """A model with a tiny network."""
    return algorithm("MlpPolicy", env, policy_kwargs={"net_arch": [8]}, device="cpu", seed=0, **keywords)


def new_env(num_envs=2, **keywords):
    return snake_env.sb3.make("SnakeField-v1", num_envs, **{"max_episode_steps": 9, **keywords})


def test_trajectories_are_those_of_dummy_vec_env():
    native = new_env(3)
    dummy = DummyVecEnv([lambda: gym.make("SnakeField-v1", max_episode_steps=9)] * 3)
    for env in (native, dummy):
        env.seed(5)
    assert_identical(native.reset(), dummy.reset(), "reset")
    assert_identical(native.reset_infos, dummy.reset_infos, "infos of the reset")
    native.action_space.seed(0)
    for step in range(25):
        actions = np.array([native.action_space.sample() for _ in range(3)])
        ours, theirs = native.step(actions), dummy.step(actions)
        assert_identical(ours[:3], theirs[:3], f"step {step}")
        for i in np.flatnonzero(ours[2]):
            assert ours[3][i].pop("episode")["l"] == 9
            assert_identical(ours[3][i], theirs[3][i], f"last info of robot {i}")
        assert all(not info for info, done in zip(ours[3], ours[2], strict=True) if not done)


def test_seeds_count_once_and_at_the_next_reset():
    env = new_env()
    assert env.seed(7) == [7, 8]
    first = env.reset()
    assert not np.array_equal(env.reset(), first)
    env.seed(7)
    np.testing.assert_array_equal(env.reset(), first)


def test_options_count_at_the_next_reset():
    env = new_env()
    env.set_options({"nonsense": 1})
    with pytest.raises(ConfigError, match=r"options\['nonsense'\]"):
        env.reset()


def test_each_robot_can_have_options_of_its_own():
    env = new_env()
    env.set_options([{"difficulty": 0.1}, {"difficulty": 0.9, "goal": (3.0, 0.5)}])
    env.reset()
    assert env.get_attr("difficulty") == [0.1, 0.9]
    goals = [state.goal.tolist() for state in env.env_method("state")]
    assert goals[1] == [3.0, 0.5] != goals[0]
    env.reset()
    assert env.env_method("state", indices=1)[0].goal.tolist() != [3.0, 0.5]


def test_rewards_are_writable_single_floats_and_infos_are_fresh():
    env = new_env()
    env.reset()
    results = [env.step(np.zeros((2, 4))) for _ in range(10)]
    reward = results[0][1]
    assert (reward.dtype, reward.flags.writeable) == (np.float32, True)
    assert len({id(infos) for *_, infos in results}) == 10
    assert "terminal_observation" in results[8][3][0]
    assert results[9][3] == [{}, {}]
    assert results[8][3][0]["TimeLimit.truncated"] is True


def test_attributes_and_methods_are_addressed_by_index():
    env = new_env(3, render_mode="rgb_array")
    env.reset()
    assert env.get_attr("control_period") == [0.05] * 3
    assert env.get_attr("render_mode", indices=1) == ["rgb_array"]
    assert env.get_attr("spec", indices=[0, 2])[0].id == "SnakeField-v1"
    assert env.has_attr("layout")
    assert not env.has_attr("nonsense")
    assert [image.shape for image in env.env_method("render", indices=[2])] == [(480, 800, 3)]
    states = env.env_method("get_state")
    assert len(states) == 3
    env.env_method("set_state", states[0], indices=2)
    assert env.env_is_wrapped(Monitor) == [True] * 3
    assert env.env_is_wrapped(gym.wrappers.TimeLimit, indices=0) == [False]
    env.set_attr("note", "hello")
    assert env.get_attr("note") == ["hello"] * 3
    with pytest.raises(ConfigError, match="indices = 0"):
        env.set_attr("note", "bye", indices=0)
    assert len(env.get_images()) == 3
    env.close()


def test_a_reset_by_index_is_of_that_robot():
    env = new_env(3)
    env.seed(0)
    env.reset()
    for _ in range(4):
        before = env.step(np.ones((3, 4)))[0]
    [(observation, info)] = env.env_method("reset", seed=7, indices=[1])
    other = new_env(1)
    other.seed(7)
    np.testing.assert_array_equal(observation, other.reset()[0])
    assert info == other.reset_infos[0] == env.reset_infos[1]
    states = env.env.get_state()
    assert [info["time"] for info in env.reset_infos] == [0.0] * 3
    infos = [env.step(np.ones((3, 4)))[3] for _ in range(9)]
    assert [bool(row[0]) for row in infos].index(True) == 4
    assert [bool(row[1]) for row in infos].index(True) == 8
    assert infos[4][0]["episode"]["l"] == infos[8][1]["episode"]["l"] == 9
    env.env.set_state(states)
    assert len(env.env_method("reset")) == 3
    assert before.shape == (3, observation.size)


def test_a_reset_of_some_robots_keeps_the_running_totals_of_the_others():
    env = new_env(2)
    env.reset()
    for _ in range(4):
        env.step(np.ones((2, 4)))
    env.set_options({"reset_mask": np.array([True, False])})
    env.reset()
    infos = [env.step(np.ones((2, 4)))[3] for _ in range(9)]
    assert infos[4][1]["episode"]["l"] == 9
    assert infos[8][0]["episode"]["l"] == 9


def test_methods_of_the_batch_are_refused_by_name():
    env = new_env()
    with pytest.raises(ConfigError, match=r"^method_name = step: expected one of reset, render"):
        env.env_method("step", np.zeros((2, 4)))


def test_one_robot_is_drawn_for_one_robot(monkeypatch):
    env = new_env(3, render_mode="rgb_array")
    env.reset()
    expected = env.get_images()[2]
    monkeypatch.setattr(type(env.env), "render", None)
    np.testing.assert_array_equal(env.env_method("render", indices=[2])[0], expected)


def test_difficulty_is_an_attribute_of_each_robot():
    env = new_env(3)
    env.set_attr("difficulty", 1.0, indices=[1])
    assert env.get_attr("difficulty") == [0.5, 1.0, 0.5]
    env.set_attr("difficulty", 0.25)
    assert env.get_attr("difficulty", indices=2) == [0.25]
    for name in ("control_period", "reward_fn", "scene", "num_threads"):
        with pytest.raises(AttributeError, match=f"{name} is fixed when the environment is made"):
            env.set_attr(name, 0.5)


def test_signals_of_every_step_are_at_hand():
    env = new_env()
    env.reset()
    env.step(np.zeros((2, 4)))
    np.testing.assert_allclose(env.signals["time"], 0.05)
    assert env.signals["is_success"].dtype == np.bool_
    assert not any(name.startswith("_") for name in env.signals)


def test_only_the_mode_of_sb3_is_accepted():
    with pytest.raises(ConfigError, match="autoreset_mode = NextStep"):
        new_env(autoreset_mode="NextStep")
    new_env(autoreset_mode="SameStep")
    with pytest.raises(ConfigError, match="autoreset_mode = NextStep"):
        snake_env.sb3.SnakeVecEnv(gym.make_vec("SnakeFree-v1"))


@pytest.mark.parametrize("env_id", ["CartPole-v1", "Pendulum-v1"])
def test_environments_of_other_packages_are_refused(env_id):
    with pytest.raises(ConfigError, match=rf"^env_id = {env_id}: expected an id of one of this package's environments"):
        snake_env.sb3.make(env_id, 2)


class Counter(snake_env.sb3.SnakeVecEnv):
    """Observations that count the steps, made from those of the native batch."""

    count = 0

    def reset(self):
        observation = super().reset()
        observation[:] = 0
        self.count = 0
        return observation

    def step_wait(self):
        observation, *rest = super().step_wait()
        self.count += 1
        observation[:] = self.count
        return observation, *rest


def test_ppo_stores_each_observation_before_the_step():
    """A reused buffer would shift the stored observations by one step without an error."""
    env = Counter(gym.make_vec("SnakeFree-v1", num_envs=2, autoreset_mode="SameStep"))
    model = small(PPO, env, n_steps=8, batch_size=8, n_epochs=1)
    model.learn(8)
    first_element = model.rollout_buffer.observations.reshape(2, 8, -1)[:, :, 0]
    np.testing.assert_array_equal(first_element, [np.arange(8)] * 2)


def test_sac_stores_observation_and_next_observation():
    env = Counter(gym.make_vec("SnakeFree-v1", num_envs=2, autoreset_mode="SameStep"))
    model = small(SAC, env, buffer_size=64, learning_starts=100)
    model.learn(16)
    stored = model.replay_buffer
    np.testing.assert_array_equal(stored.observations[:8, 0, 0], np.arange(8))
    np.testing.assert_array_equal(stored.next_observations[:8, 0, 0], np.arange(1, 9))


def test_the_usual_stack_trains_evaluates_saves_and_loads(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        env = VecNormalize(VecMonitor(new_env(4, monitor=False)))
        eval_env = VecNormalize(VecMonitor(new_env(2, monitor=False)), training=False)
        callback = EvalCallback(eval_env, n_eval_episodes=2, eval_freq=8, best_model_save_path=tmp_path, verbose=0)
        model = small(PPO, env, n_steps=16, batch_size=32, n_epochs=1)
        model.learn(128, callback=callback)
        model.save(tmp_path / "model")
        env.save(tmp_path / "vecnormalize.pkl")
    assert (tmp_path / "best_model.zip").exists()
    loaded = PPO.load(
        tmp_path / "model", env=VecNormalize.load(tmp_path / "vecnormalize.pkl", new_env(4)), device="cpu"
    )
    observation = loaded.get_env().reset()
    np.testing.assert_array_equal(*(m.predict(observation, deterministic=True)[0] for m in (model, loaded)))


def test_evaluate_policy_takes_the_reported_episodes():
    env = new_env(2)
    model = small(PPO, env, n_steps=8, batch_size=16)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        returns, lengths = evaluate_policy(model, env, n_eval_episodes=4, return_episode_rewards=True)
    assert lengths == [9] * 4
    assert np.isfinite(returns).all()


def test_frame_stack_and_video(tmp_path):
    env = VecFrameStack(new_env(2, render_mode="rgb_array"), 3)
    assert env.reset().shape == (2, 3 * env.get_attr("single_observation_space")[0].shape[0])
    env.step(np.zeros((2, 4)))
    pytest.importorskip("moviepy")
    video = VecVideoRecorder(env, str(tmp_path), record_video_trigger=lambda step: step == 0, video_length=3)
    video.reset()
    for _ in range(4):
        video.step(np.zeros((2, 4)))
    video.close()
    assert list(tmp_path.glob("*.mp4"))


def test_rl_zoo_hook_puts_the_native_batch_in_place():
    dummy = DummyVecEnv([lambda: gym.make("SnakeField-v1")] * 3)
    env = snake_env.sb3.native(dummy, env_id="SnakeFree-v1", seed=4, max_episode_steps=5)
    assert isinstance(env, VecMonitor)
    assert isinstance(env.venv, snake_env.sb3.SnakeVecEnv)
    assert env.num_envs == 3
    expected = snake_env.sb3.make("SnakeFree-v1", 3, max_episode_steps=5)
    expected.seed(4)
    np.testing.assert_array_equal(env.reset(), expected.reset())
    infos = [env.step(np.zeros((3, 4)))[3] for _ in range(5)][-1]
    assert infos[0]["episode"]["l"] == 5


@pytest.mark.parametrize(("module", "algorithm"), [("zoo", PPO), ("zoo.sac", SAC)])
def test_zoo_hyperparameters_fit_their_algorithm(module, algorithm):
    import importlib
    import inspect

    hyperparams = importlib.import_module(f"snake_env.{module}").hyperparams
    assert set(hyperparams) == set(TASKS)
    of_the_zoo = {"n_envs", "n_timesteps", "policy", "vec_env_wrapper"}
    for values in hyperparams.values():
        assert set(values) - of_the_zoo <= set(inspect.signature(algorithm).parameters)
