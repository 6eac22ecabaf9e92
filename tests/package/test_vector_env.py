"""The native batch keeps Gymnasium's rules and equals SyncVectorEnv of the single environment."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from conftest import MODES
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from snake_env import Randomization, SnakeEnv, SnakeVectorEnv, Start
from snake_env.testing import assert_identical, check_vector_env


@pytest.mark.parametrize("action_mode", ["gait", "joints", "residual"])
def test_the_checker_finds_nothing(env_id, action_mode):
    keywords = {"action_mode": action_mode, "max_episode_steps": 9}
    check_vector_env(
        lambda **given: gym.make_vec(env_id, **keywords, **given),
        lambda: gym.make(env_id, **keywords),
        steps=25,
    )


def to_goal(state, action, previous_action):
    return -np.linalg.norm(state.goal - state.link_position[:, 0], axis=1)


def too_far(state, action, previous_action):
    return state["time"] > 0.17


VARIED = Randomization(friction=(0.5, 1.5), anisotropy=(0.8, 1.2), mass=(0.8, 1.2), torque_limit=(0.7, 1.0))
SENSING = {
    "task": "field",
    "observation_blocks": ["accelerometer", "gyro", "motor_torque", "touch", "touch_side", "range"],
    "observation_noise": {"range": 0.05, "gyro": 0.1},
    "observation_delay": {"accelerometer": 0.1},
}
WITH = {
    "blocks": {"task": "field", "observation": "dict"},
    "functions": {"task": "field", "reward_fn": to_goal, "termination_fn": too_far},
    "randomised": {"task": "field", "randomization": Randomization.thesis()},
    "privileged": {"task": "field", "privileged": True, "randomization": VARIED},
    "noise and delay": {
        "task": "field",
        "observation_noise": {"joint_rate": 0.1},
        "observation_delay": {"pegs": 0.1, "joint_angle": 0.25},
    },
    "sensors": SENSING,
    "sensors in 3D": {"model": "spatial", **SENSING},
    "raised": {
        "model": "spatial",
        "task": "free",
        "start": Start(position=(0.0, 0.0, 0.35), pitch=0.5, posture="straight"),
    },
}


@pytest.mark.parametrize("options", WITH.values(), ids=WITH)
def test_the_checkers_find_nothing_with_what_may_be_asked_for(options):
    options = {"max_episode_steps": 8, **options}
    check_env(SnakeEnv(**options), skip_render_check=True)
    check_vector_env(lambda **given: SnakeVectorEnv(**options, **given), lambda: SnakeEnv(**options))


@pytest.mark.parametrize("mode", MODES)
def test_equals_sync_by_gymnasiums_own_measure(env_id, mode):
    """As gymnasium's test_vector_env_equal, with the native batch on one side; terminations included."""
    keywords = {"max_episode_steps": 30, "goal_distance": 0.1, "goal_radius": 0.05}
    native = gym.make_vec(env_id, num_envs=3, autoreset_mode=mode, **keywords)
    sync = SyncVectorEnv([lambda: gym.make(env_id, **keywords)] * 3, autoreset_mode=mode)
    assert data_equivalence(native.reset(seed=123), sync.reset(seed=123))
    native.action_space.seed(123)
    terminations = 0
    for _ in range(60):
        actions = 0.1 * native.action_space.sample()
        ours, theirs = native.step(actions), sync.step(actions)
        assert data_equivalence(ours, theirs)
        terminations += np.count_nonzero(ours[2])
        finished = ours[2] | ours[3]
        if mode == "Disabled" and finished.any():
            mask = {"reset_mask": finished}
            assert data_equivalence(native.reset(options=dict(mask)), sync.reset(options=dict(mask)))
    assert terminations > 0 or env_id != "SnakeCourse-v1"
    native.close()
    sync.close()


def test_a_goal_reached_in_the_last_step_is_terminated_and_truncated_as_gymnasium_has_it():
    keywords = {"goal_distance": 0.1, "goal_radius": 0.05, "start_jitter": 0.0}
    env = gym.make_vec("SnakeCourse-v1", num_envs=1, **keywords)
    env.reset(seed=0)
    steps = 0
    terminated = np.array([False])
    while not terminated[0]:
        terminated = env.step(np.zeros((1, 4)))[2]
        steps += 1
    native = gym.make_vec("SnakeCourse-v1", num_envs=1, max_episode_steps=steps, **keywords)
    single = gym.make("SnakeCourse-v1", max_episode_steps=steps, **keywords)
    native.reset(seed=0)
    single.reset(seed=0)
    for _ in range(steps):
        ours, theirs = native.step(np.zeros((1, 4))), single.step(np.zeros(4))
    assert (ours[2][0], ours[3][0]) == theirs[2:4] == (True, True)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_robot_does_not_depend_on_the_size_of_the_batch(model):
    small, large = (gym.make_vec("SnakeField-v1", num_envs=n, model=model) for n in (2, 9))
    small.reset(seed=[8, 3])
    large.reset(seed=list(range(9)))
    actions = np.linspace(-1, 1, large.action_space.sample().size).reshape(9, -1)
    for _ in range(10):
        few, many = small.step(actions[[8, 3]])[0], large.step(actions)[0]
    np.testing.assert_array_equal(few, many[[8, 3]])


def test_an_unseeded_reset_goes_on_with_the_stream(make):
    env = make(num_envs=2)
    first = [env.reset(seed=5)[0], env.reset()[0], env.reset()[0]]
    again = [env.reset(seed=5)[0], env.reset()[0], env.reset()[0]]
    assert_identical(first, again, "the same seed twice")
    assert not np.array_equal(first[0], first[1])
    assert not np.array_equal(first[1], first[2])


def test_robots_that_never_had_a_seed_differ(make):
    one, other = make(num_envs=2).reset()[0], make(num_envs=2).reset()[0]
    assert not np.array_equal(one, other)
    assert not np.array_equal(one[0], one[1])


def test_a_masked_reset_uses_the_seeds_of_its_rows_alone(make):
    env = make(num_envs=3, autoreset_mode="Disabled")
    env.reset(seed=0)
    env.reset(seed=[70, 71, 72], options={"reset_mask": np.array([False, True, False])})
    ours = env.reset()[0]
    expected = make(num_envs=3)
    expected.reset(seed=[0, 71, 2])
    np.testing.assert_array_equal(ours, expected.reset()[0])


def test_disabled_mode_refuses_to_step_finished_robots(make):
    env = make(num_envs=2, autoreset_mode="Disabled")
    env.reset(seed=0)
    for _ in range(9):
        env.step(np.zeros((2, 4)))
    with pytest.raises(AssertionError, match=r"environments \[0, 1\] have finished"):
        env.step(np.zeros((2, 4)))


def test_the_mode_may_be_a_member_or_its_name(make):
    for mode in AutoresetMode:
        assert make(autoreset_mode=mode).metadata["autoreset_mode"] is mode
        assert make(autoreset_mode=mode.value).metadata["autoreset_mode"] is mode
    assert make().metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert "autoreset_mode" not in SnakeVectorEnv.metadata


def test_control_period_sets_the_time_of_a_step():
    env = SnakeVectorEnv(2, task="free", control_period=0.1)
    env.reset(seed=0)
    infos = env.step(np.zeros((2, 4)))[4]
    assert (env.control_period, env.metadata["render_fps"]) == (0.1, 10)
    np.testing.assert_allclose(infos["time"], 0.1)
