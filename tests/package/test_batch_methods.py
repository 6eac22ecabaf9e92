"""What environments offer beside reset and step: blocks of the observation, and methods for one robot of many."""

from __future__ import annotations

import sys

import gymnasium as gym
import numpy as np
import pytest
from conftest import run_python
from gymnasium.error import DependencyNotInstalled

from snake_env import ConfigError, SnakeEnv, SnakeVectorEnv
from snake_env.testing import assert_identical


def test_blocks_of_the_observation_are_chosen_by_name():
    all_of_them, some = SnakeVectorEnv(2, task="field"), ["yaw_rate", "joint_angle"]
    env = SnakeVectorEnv(2, task="field", observation_blocks=some)
    blocks = {block["name"]: block for block in all_of_them.layout["observation"]}
    expected = all_of_them.reset(seed=0)[0]
    parts = [expected[:, blocks[name]["start"] :][:, : blocks[name]["size"]] for name in ("joint_angle", "yaw_rate")]
    np.testing.assert_array_equal(env.reset(seed=0)[0], np.concatenate(parts, axis=1))
    assert [block["name"] for block in env.layout["observation"]] == ["joint_angle", "yaw_rate"]
    assert env.single_observation_space.shape == (11,)


def test_an_observation_may_be_a_mapping_of_blocks():
    flat, env = SnakeVectorEnv(3, task="field"), SnakeVectorEnv(3, task="field", observation="dict")
    whole, parts = flat.reset(seed=0)[0], env.reset(seed=0)[0]
    np.testing.assert_array_equal(np.concatenate(list(parts.values()), axis=1), whole)
    assert set(env.single_observation_space.spaces) == {block["name"] for block in env.layout["observation"]}
    whole, parts = flat.step(np.ones((3, 4)))[0], env.step(np.ones((3, 4)))[0]
    np.testing.assert_array_equal(np.concatenate(list(parts.values()), axis=1), whole)


def test_stable_baselines_learns_from_mappings():
    sb3 = pytest.importorskip("snake_env.sb3")
    from stable_baselines3 import PPO

    env = sb3.make("SnakeField-v1", 2, observation="dict", max_episode_steps=5)
    PPO("MultiInputPolicy", env, n_steps=8, batch_size=8, n_epochs=1, device="cpu", seed=0).learn(16)
    env.seed(3)
    env.reset()
    infos = [env.step(np.zeros((2, 4)))[3] for _ in range(5)][-1]
    assert infos[0]["terminal_observation"]["joint_angle"].shape == (10,)


def test_methods_and_attributes_are_called_as_in_gymnasiums_own_batches():
    env = gym.make_vec("SnakeField-v1", num_envs=3, render_mode="rgb_array")
    env.reset(seed=0)
    assert env.get_attr("control_period") == (0.05,) * 3
    env.call("set_difficulty", 0.75)
    assert env.get_attr("difficulty") == (0.75,) * 3
    env.set_attr("difficulty", [0.0, 0.5, 1.0])
    assert env.call("difficulty") == (0.0, 0.5, 1.0)
    env.set_attr("note", "hello")
    assert env.get_attr("note") == ("hello",) * 3
    pictures = env.call("render")
    assert [picture.shape for picture in pictures] == [(480, 800, 3)] * 3
    states = env.call("state")
    assert_identical(states[2].arrays(), env.unwrapped.state().robot(2).arrays(), "state of robot 2")
    observations = [observation for observation, _ in env.call("reset", seed=4)]
    single = gym.make("SnakeField-v1", difficulty=1.0)
    np.testing.assert_array_equal(observations[2], single.reset(seed=4)[0])
    with pytest.raises(ConfigError, match=r"^method_name = step: "):
        env.call("step", np.zeros(4))
    with pytest.raises(ConfigError, match=r"^values = 3 values of note: "):
        env.set_attr("note", [1, 2, 3])
    with pytest.raises(AttributeError):
        env.get_attr("nonsense")


def test_modules_that_import_others_are_loaded_when_they_are_named():
    pytest.importorskip("stable_baselines3")
    code = """
        import sys
        import snake_env
        assert "torch" not in sys.modules and "stable_baselines3" not in sys.modules
        print(snake_env.sb3.make("SnakeFree-v1", 2).num_envs, hasattr(snake_env, "nonsense"))
    """
    assert run_python(code, timeout=300) == "2 False"


def test_a_missing_pygame_comes_with_the_command_that_installs_it(monkeypatch):
    for module in ("snake_env.rendering", "snake_env.side_view"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setitem(sys.modules, "pygame", None)
    env = SnakeEnv(task="free", render_mode="rgb_array")
    env.reset(seed=0)
    with pytest.raises(DependencyNotInstalled, match=r"pygame is missing: pip install 'snake-robot-env\[render\]'"):
        env.render()
