"""The reward is the sum of its terms, or what a function of the caller makes of the signals."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, SnakeEnv, SnakeVectorEnv, rewards


def test_reward_terms_add_up_to_the_reward(env_id):
    env = gym.make_vec(env_id, num_envs=3, goal_distance=0.1, goal_radius=0.05)
    _, infos = env.reset(seed=0)
    env.action_space.seed(0)
    terms = [name for name in infos if name.startswith("reward_")]
    assert len(terms) == 5
    for _ in range(40):
        actions = env.action_space.sample()
        _, reward, _, _, infos = env.step(actions)
        np.testing.assert_allclose(reward, sum(infos[name] for name in terms), atol=1e-12)


def test_the_reward_can_be_replaced(make):
    seen = []

    def reward_fn(state, action, previous_action):
        seen.append((action.copy(), previous_action.copy()))
        assert state.link_position.shape == (len(action), 11, 2)
        return state["distance"] - 0.5 * np.square(action - previous_action).sum(axis=1)

    env = make(num_envs=3, reward_fn=reward_fn)
    single = gym.make("SnakeField-v1", max_episode_steps=9, reward_fn=reward_fn)
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
        np.testing.assert_array_equal(infos["reward_custom"], reward)
        assert [name for name in infos if name.startswith("reward_")] == ["reward_custom"]
        assert single.step(actions[0])[1] == reward[0]
        previous = actions
    seen.clear()
    _, reward, *_ = env.step(actions)
    assert not reward.any()
    assert seen[0][0].shape == (0, 4)
    env.step(actions)
    assert not seen[-1][1].any()


@pytest.mark.parametrize(
    ("rewards", "message"),
    [
        ([0.0, np.nan, 0.0], r"reward_fn\[1\] = nan: expected a finite reward of robot 1"),
        (np.array([0.0, 0.0, -np.inf]), r"reward_fn\[2\] = -inf: expected a finite reward of robot 2"),
        (["1", "2", "3"], r"reward_fn = rewards of dtype <U1: expected real numbers"),
        ([1j, 0.0, 0.0], r"reward_fn = rewards of dtype complex128: expected real numbers"),
        ([None, 0.0, 0.0], r"reward_fn = rewards of dtype object: expected real numbers"),
        ([[0.0], [0.0, 1.0], 0.0], r"reward_fn = rewards in rows of different lengths: expected shape \(3,\)"),
        (None, r"reward_fn = rewards of shape \(\)"),
        (0.0, r"reward_fn = rewards of shape \(\): expected shape \(3,\)"),
    ],
)
def test_rewards_that_are_no_finite_numbers_are_refused(make, rewards, message):
    env = make(num_envs=3, reward_fn=lambda state, action, previous_action: rewards)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=f"^{message}"):
        env.step(np.zeros((3, 4)))


def test_a_refused_reward_names_the_robot_of_the_batch():
    """Where robots that start anew are left out of the rows."""
    rewards = [0.0, 0.0, 0.0]
    env = SnakeVectorEnv(
        3,
        task="free",
        reward_fn=lambda state, action, previous_action: np.array(rewards[: len(action)]),
        termination_fn=lambda state, action, previous_action: np.arange(len(action)) == 0,
    )
    env.reset(seed=0)
    env.step(np.zeros((3, 4)))
    rewards[0] = np.nan
    with pytest.raises(ConfigError, match=r"^reward_fn\[0\] = nan: expected a finite reward of robot 1"):
        env.step(np.zeros((3, 4)))


@pytest.mark.parametrize("rewards", [[1, 2, 3], np.ones(3, np.float32), np.ones(3, np.uint8), np.arange(3) == 1])
def test_rewards_may_be_of_any_real_type(make, rewards):
    env = make(num_envs=3, reward_fn=lambda state, action, previous_action: rewards)
    env.reset(seed=0)
    np.testing.assert_array_equal(env.step(np.zeros((3, 4)))[1], rewards)


@pytest.mark.parametrize(
    ("flags", "dtype"), [(["yes", "no"], "<U3"), ([None, True], "object"), ([0, 1], "int"), (np.zeros(2), "float64")]
)
def test_flags_of_another_type_are_refused(make, flags, dtype):
    env = make(num_envs=2, termination_fn=lambda state, action, previous_action: flags)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=rf"^termination_fn = flags of dtype {dtype}.*: expected dtype bool"):
        env.step(np.zeros((2, 4)))


def too_far(state, action, previous_action):
    return state["time"] > 0.17


def test_a_function_ends_episodes():
    env = SnakeEnv(task="free", termination_fn=too_far)
    env.reset(seed=0)
    assert [env.step(np.zeros(4))[2] for _ in range(4)] == [False, False, False, True]


@pytest.mark.parametrize(("ends", "terminated"), [(True, True), (False, False)])
def test_the_built_in_terminations_can_be_switched_off(ends, terminated):
    env = SnakeEnv(task="free", goal_distance=0.1, corridor_half_width=5.0, termination={"is_success": ends})
    env.reset(seed=0)
    results = [env.step(np.zeros(4)) for _ in range(60)]
    assert any(result[2] for result in results) == terminated
    assert any(result[4]["is_success"] for result in results)
    paid = [result[4]["reward_success"] for result in results]
    assert np.count_nonzero(paid) == 1


@pytest.mark.parametrize("task", ["field", "command"])
@pytest.mark.parametrize("term", rewards.TERMS)
def test_the_functions_of_the_built_in_terms_are_those_of_the_core(term, task):
    """The goal is reached, so that every term of the task is paid, success once even where it does not end episodes."""
    goal = {"field": 0.1, "command": {"point": (0.1, 0.0), "speed": 0.1}}[task]
    options = {"task": task, "goal": goal, "max_episode_steps": 60, "autoreset_mode": "SameStep"}
    options |= {"termination": {"is_success": False}, "start_jitter": 0.0}
    weights = dict.fromkeys(rewards.TERMS, 0.0) | {term: 1.0}
    built_in = SnakeVectorEnv(3, reward_weights=weights, **options)
    own = SnakeVectorEnv(3, reward_fn=getattr(rewards, term), **options)
    for env in (built_in, own):
        env.reset(seed=0)
    built_in.action_space.seed(0)
    total = 0.0
    for _ in range(60):
        actions = built_in.action_space.sample() * 0.2
        expected, found = built_in.step(actions)[1], own.step(actions)[1]
        np.testing.assert_allclose(found, expected, atol=1e-15)
        total += np.abs(expected).sum()
    assert (total > 0.0) == (term != {"field": "tracking", "command": "progress"}[task])


def test_the_built_in_reward_is_the_weighted_sum_of_its_terms():
    env = SnakeVectorEnv(3, task="field")
    env.reset(seed=0)
    weights = [env.layout["config"]["reward_weights"][name] for name in rewards.TERMS]
    for _ in range(20):
        _, reward, *_ = env.step(np.ones((3, 4)))
        np.testing.assert_allclose(env.state().reward_terms @ weights, reward, atol=1e-12)
