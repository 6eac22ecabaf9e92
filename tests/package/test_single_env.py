"""The single environment keeps the rules of Gymnasium and Stable-Baselines3, without a warning."""

from __future__ import annotations

import warnings

import gymnasium as gym
import numpy as np
import pytest
from conftest import ENV_IDS
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import snake_env
from snake_env import ConfigError, SnakeEnv

VARIANTS = [
    {},
    {"action_mode": "joints", "perception": "body"},
    {"action_mode": "residual", "perception": "blind"},
]


@pytest.mark.parametrize("keywords", VARIANTS)
def test_gymnasiums_checker_finds_nothing(env_id, keywords):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(env_id, render_mode="rgb_array", **keywords).unwrapped)


@pytest.mark.parametrize("keywords", VARIANTS)
def test_sb3s_checker_finds_nothing(env_id, keywords):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make(env_id, render_mode="rgb_array", **keywords).unwrapped
        checker.check_env(env, warn=True, skip_render_check=False)


@pytest.mark.parametrize("env_id", ENV_IDS)
def test_values_have_pythons_types(env_id):
    env = gym.make(env_id)
    observation, info = env.reset(seed=0)
    for _ in range(3):
        assert isinstance(observation, np.ndarray)
        assert observation.dtype == np.float32
        assert {type(value) for value in info.values()} == {float, bool, int}
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert (type(reward), type(terminated), type(truncated)) == (float, bool, bool)


def test_the_time_limit_is_gymnasiums():
    env = gym.make("SnakeFree-v1", max_episode_steps=700, goal_distance=20.0, corridor_half_width=5.0)
    env.reset(seed=0)
    results = [env.step(np.zeros(4))[2:4] for _ in range(700)]
    assert results.index((False, True)) == 699


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda env: env.reset(seed=-1), "seed"),
        (lambda env: env.reset(seed=[1]), "seed"),
        (lambda env: env.reset(options={"x": 1}), r"options\['x'\]"),
        (lambda env: env.step(np.zeros((1, 4))), "action"),
        (lambda env: env.step(np.array([0.0, 0.0, np.nan, 0.0])), r"action\[2\]"),
        (lambda env: env.step("left"), "action"),
    ],
)
def test_bad_input_is_named(call, field):
    env = SnakeEnv(task="free")
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=f"^{field} = "):
        call(env)


def test_step_needs_a_reset_first():
    env = SnakeEnv(task="free")
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(4))


def test_close_closes_the_window_and_nothing_else():
    """Gymnasium's own environments can be used again, and Stable-Baselines3's checker does so."""
    env = SnakeEnv(task="free", render_mode="human", control_period=0.01)
    before = env.reset(seed=0)[0]
    env.close()
    env.close()
    np.testing.assert_array_equal(env.reset(seed=0)[0], before)
    env.step(np.zeros(4))
    env.close()


def test_attributes_that_nothing_would_heed_cannot_be_set():
    env = SnakeEnv(task="free")
    with pytest.raises(AttributeError):
        env.control_period = 0.5
    env.difficulty = 0.25
    assert env.difficulty == 0.25


def test_the_observation_is_not_constant_and_never_leaves_its_bounds(env_id):
    env = gym.make_vec(env_id, num_envs=16, action_mode="residual", max_episode_steps=140)
    rows = [env.reset(seed=0)[0]]
    env.action_space.seed(0)
    for _ in range(280):
        action = env.action_space.sample()
        action[:8] = np.eye(action.shape[1])[1]  # half of them in the thesis's wave at its fastest, to meet pegs
        rows.append(env.step(action)[0])
        assert rows[-1] in env.observation_space
    spread = np.ptp(np.concatenate(rows), axis=0)
    names = [f"{block['name']} {element}" for block in env.layout["observation"] for element in block["elements"]]
    assert len(names) == len(spread)
    constant = [name for name, width in zip(names, spread, strict=True) if width == 0.0]
    # Robots in pipes and on poles do not come to the ground.
    wound = env_id in ("SnakePipe-v1", "SnakeClimb-v1")
    assert [name for name in constant if not (wound and name.startswith("normal_force"))] == []


def test_the_layout_describes_actions():
    layout = SnakeEnv(task="field", action_mode="residual", robot={"links": 5}).layout
    assert [entry["name"] for entry in layout["action"][:4]] == [
        "amplitude",
        "frequency",
        "phase_shift",
        "offset",
    ]
    assert len(layout["action"]) == 8
    assert layout["control_period"] == 0.05


def test_the_package_exports_what_it_promises():
    for name in snake_env.__all__:
        assert hasattr(snake_env, name)
