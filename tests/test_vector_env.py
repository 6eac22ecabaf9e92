"""The native batch keeps Gymnasium's rules and equals SyncVectorEnv of the single environment."""

from __future__ import annotations

import gc
import timeit

import gymnasium as gym
import numpy as np
import pytest
from conftest import MODES
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import snake_env
from snake_env import ConfigError, SnakeVectorEnv
from snake_env.testing import assert_identical, check_vector_env


@pytest.mark.parametrize("action_mode", ["gait", "joints", "residual"])
def test_the_checker_finds_nothing(env_id, action_mode):
    keywords = {"action_mode": action_mode, "max_episode_steps": 9}
    check_vector_env(
        lambda **given: gym.make_vec(env_id, **keywords, **given),
        lambda: gym.make(env_id, **keywords),
        steps=25,
    )


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
    assert terminations > 0 or env_id != "SnakeCourse-v0"
    native.close()
    sync.close()


def test_a_goal_reached_in_the_last_step_is_terminated_and_truncated_as_gymnasium_has_it():
    keywords = {"goal_distance": 0.1, "goal_radius": 0.05, "start_jitter": 0.0}
    env = gym.make_vec("SnakeCourse-v0", num_envs=1, **keywords)
    env.reset(seed=0)
    steps = 0
    terminated = np.array([False])
    while not terminated[0]:
        terminated = env.step(np.zeros((1, 4)))[2]
        steps += 1
    native = gym.make_vec("SnakeCourse-v0", num_envs=1, max_episode_steps=steps, **keywords)
    single = gym.make("SnakeCourse-v0", max_episode_steps=steps, **keywords)
    native.reset(seed=0)
    single.reset(seed=0)
    for _ in range(steps):
        ours, theirs = native.step(np.zeros((1, 4))), single.step(np.zeros(4))
    assert (ours[2][0], ours[3][0]) == theirs[2:4] == (True, True)


def test_row_zero_is_the_single_environment(env_id):
    batch = gym.make_vec(env_id, num_envs=5)
    single = gym.make(env_id)
    rows, infos = batch.reset(seed=11)
    row, info = single.reset(seed=11)
    for k in range(20):
        np.testing.assert_array_equal(row, rows[0])
        assert info == {name: infos[name][0] for name in info}
        actions = np.full(batch.action_space.shape, np.sin(k), np.float32)
        rows, rewards, _, _, infos = batch.step(actions)
        row, reward, _, _, info = single.step(actions[0])
        assert reward == rewards[0]


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_results_do_not_depend_on_the_number_of_threads(threads):
    runs = []
    for num_threads in (1, threads):
        env = gym.make_vec("SnakeField-v0", num_envs=20, num_threads=num_threads, max_episode_steps=6)
        env.action_space.seed(0)
        runs.append([env.reset(seed=0)] + [env.step(env.action_space.sample()) for _ in range(15)])
    assert_identical(*runs, f"1 and {threads} threads")


def test_an_adaptive_robot_steps_by_itself_in_a_batch():
    keywords = {"max_episode_steps": 20, "integrator": {"method": "adaptive", "tolerance": 1e-3}}
    one, many = (gym.make_vec("SnakeCourse-v0", num_envs=n, **keywords) for n in (1, 3))
    np.testing.assert_array_equal(one.reset(seed=[7])[0][0], many.reset(seed=[6, 7, 8])[0][1])
    actions = np.linspace(-1, 1, 12).reshape(3, 4)
    for _ in range(5):
        np.testing.assert_array_equal(one.step(actions[1:2])[0][0], many.step(actions)[0][1])


def test_a_robot_does_not_depend_on_the_size_of_the_batch():
    small, large = (gym.make_vec("SnakeField-v0", num_envs=n) for n in (2, 9))
    small.reset(seed=[8, 3])
    large.reset(seed=list(range(9)))
    actions = np.linspace(-1, 1, 36).reshape(9, 4)
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


@pytest.mark.parametrize(
    ("seed", "field"),
    [
        (-1, "seed"),
        (2**64, "seed"),
        (1.5, "seed"),
        ("1", "seed"),
        (True, "seed"),
        ([1, 2], "seed"),
        ([1, 2, -3], r"seed\[2\]"),
        ([1, "x", 3], r"seed\[1\]"),
    ],
)
def test_a_bad_seed_is_named(make, seed, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        make(num_envs=3).reset(seed=seed)


def test_large_seeds_and_numpy_seeds_are_welcome(make):
    env = make(num_envs=2)
    env.reset(seed=2**64 - 2)
    env.reset(seed=np.uint64(2**63))
    env.reset(seed=np.array([3, 4]))


def test_an_unknown_option_is_named(make):
    with pytest.raises(ConfigError, match=r"options\['resetmask'\].*reset_mask"):
        make(num_envs=2).reset(options={"resetmask": None})
    with pytest.raises(ConfigError, match=r"options\['reset_mask'\] = .*a bool array of shape \(2,\)") as caught:
        make(num_envs=2).reset(options={"reset_mask": [True, False]})
    assert isinstance(caught.value, TypeError)


@pytest.mark.parametrize(
    ("actions", "complaint"),
    [
        (np.zeros((2, 4)), r"action = shape \(2, 4\): expected shape \(3, 4\)"),
        (np.zeros(12), r"action = shape \(12,\)"),
        (np.zeros((3, 4), complex), "action = dtype complex128"),
        (np.zeros((3, 4), bool), "action = dtype bool"),
        ([["a"] * 4] * 3, "action = dtype <U1"),
        ([[0.0] * 4, [0.0] * 3, [0.0] * 4], "action = rows of different lengths"),
        (None, "action = dtype object"),
    ],
)
def test_a_bad_action_is_named(make, actions, complaint):
    env = make(num_envs=3)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=complaint):
        env.step(actions)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_action_that_is_not_finite_names_robot_and_element(make, value):
    env = make(num_envs=3)
    env.reset(seed=0)
    actions = np.zeros((3, 4))
    actions[1, 2] = value
    with pytest.raises(ConfigError, match=r"action\[1, 2\] = .*: expected a finite number"):
        env.step(actions)
    env.step(np.zeros((3, 4)))


def test_actions_of_any_real_type_and_layout_are_welcome(make):
    torch = pytest.importorskip("torch")
    values = np.array([[0.5, -0.25, 0.0, 1.0]] * 2)
    forms = [
        values,
        values.astype(np.float32),
        np.asfortranarray(values),
        values.tolist(),
        torch.tensor(values),
    ]
    results = []
    for actions in forms:
        env = make(num_envs=2)
        env.reset(seed=0)
        results.append(env.step(actions))
    for result in results[1:]:
        assert_identical(result, results[0], "the same actions in another form")


def test_actions_beyond_the_box_are_clipped(make):
    runs = []
    for scale in (1.0, 50.0):
        env = make(num_envs=2)
        env.reset(seed=0)
        runs.append(env.step(np.full((2, 4), scale)))
    assert_identical(*runs, "actions at and beyond the bound")


@pytest.mark.parametrize(
    ("keywords", "field"),
    [
        ({"num_envs": 0}, "num_envs"),
        ({"num_envs": 2.5}, "num_envs"),
        ({"num_threads": 0}, "num_threads"),
        ({"num_threads": 10**6}, "num_threads"),
        ({"autoreset_mode": "next"}, "autoreset_mode"),
        ({"render_mode": "bogus"}, "render_mode"),
        ({"max_episode_steps": 0}, "max_episode_steps"),
        ({"max_episode_steps": -5}, "max_episode_steps"),
        ({"task": "labyrinth"}, "task"),
        ({"action_mode": "torque"}, "action_mode"),
        ({"perception": "lidar"}, "perception"),
        ({"nearest_pegs": 0}, "nearest_pegs"),
        ({"nearest_pegs": 65}, "nearest_pegs"),
        ({"control_period": 0.0}, "control_period"),
        ({"control_period": float("nan")}, "control_period"),
        ({"goal_distance": -1.0}, "goal_distance"),
        ({"corridor_half_width": float("inf")}, "corridor_half_width"),
        ({"goal_radius": 0.0}, "goal_radius"),
        ({"goal_radius": 1.9, "task": "maze"}, "goal_radius"),
        ({"turn": 2.0}, "turn"),
        ({"push_points": 5}, "push_points"),
        ({"perturbation": {"course": "table-7.4"}}, r"perturbation\.course"),
        ({"perturbation": {"without": [8]}}, r"perturbation\.without\[0\]"),
        ({"perturbation": {"removed": 1.5}}, r"perturbation\.removed"),
        ({"difficulty": 1.01}, "difficulty"),
        ({"field": "forest"}, "field"),
        ({"friction": (0.2, -0.1)}, r"friction\[1\]"),
        ({"friction": 0.2}, "friction"),
        ({"controller": {"kp": -1.0}}, r"controller\.kp"),
        ({"controller": {"ki": 1.0}}, r"controller\.ki"),
        ({"integrator": {"method": "rk4"}}, r"integrator\.method"),
        ({"robot": {"links": 1}}, r"robot\.links"),
        ({"robot": {"mass": [1.0, 2.0]}}, r"robot\.mass"),
        ({"reward_weights": {"progress": float("nan")}}, r"reward_weights\.progress"),
        ({"reward_weights": {"beauty": 1.0}}, r"reward_weights\.beauty"),
        ({"start_jitter": 2.0}, "start_jitter"),
        ({"dificulty": 0.5}, "dificulty"),
    ],
)
def test_every_keyword_is_checked(keywords, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        SnakeVectorEnv(**{"num_envs": 2, "task": "field", **keywords})


def test_sections_may_be_dataclasses_or_mappings():
    one = SnakeVectorEnv(2, task="free", robot=snake_env.Robot(links=5), controller=snake_env.PD(torque_limit=3.0))
    other = SnakeVectorEnv(2, task="free", robot={"links": 5}, controller={"torque_limit": 3.0})
    assert_identical(one.reset(seed=0), other.reset(seed=0), "dataclass and mapping")


def test_step_needs_a_reset_first(make):
    with pytest.raises(ResetNeeded):
        make(num_envs=2).step(np.zeros((2, 4)))
    with pytest.raises(ResetNeeded):
        make(num_envs=2, autoreset_mode="Disabled").reset(options={"reset_mask": np.array([True, False])})


def test_a_closed_environment_says_so(make):
    env = make(num_envs=2)
    env.reset(seed=0)
    states = env.get_state()
    env.close()
    env.close()
    calls = [env.reset, lambda: env.step(np.zeros((2, 4))), env.render]
    calls += [env.get_state, lambda: env.set_state(states), lambda: env.set_difficulty(0.5)]
    for call in calls:
        with pytest.raises(ClosedEnvironmentError):
            call()


def test_a_half_made_environment_can_be_collected():
    with pytest.raises(ConfigError):
        SnakeVectorEnv(2, render_mode="bogus")
    gc.collect()


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


def test_num_threads_follows_argument_then_variable_then_cores(monkeypatch):
    monkeypatch.setenv("SNAKE_ENV_NUM_THREADS", "3")
    assert SnakeVectorEnv(64).num_threads == 3
    assert SnakeVectorEnv(64, num_threads=2).num_threads == 2
    monkeypatch.setenv("SNAKE_ENV_NUM_THREADS", "many")
    with pytest.raises(ConfigError, match="SNAKE_ENV_NUM_THREADS = 'many'"):
        SnakeVectorEnv(64)
    monkeypatch.delenv("SNAKE_ENV_NUM_THREADS")
    monkeypatch.setattr("snake_env._threads.cores", lambda: 4)
    assert [SnakeVectorEnv(n).num_threads for n in (1, 8, 9, 17, 1000)] == [1, 1, 2, 3, 4]


def test_control_period_sets_the_time_of_a_step():
    env = SnakeVectorEnv(2, task="free", control_period=0.1)
    env.reset(seed=0)
    infos = env.step(np.zeros((2, 4)))[4]
    assert (env.control_period, env.metadata["render_fps"]) == (0.1, 10)
    np.testing.assert_allclose(infos["time"], 0.1)


def test_the_interface_costs_little():
    """Measured in units of numpy.zeros(256), whose cost rises and falls with the load of the machine as well.

    About 20 units were measured, 5 to 10 us; results made anew each step would cost 100.
    """
    unit = min(timeit.repeat(lambda: np.zeros(256), number=200, repeat=50)) / 200
    assert interface_overhead() < 50 * unit


def interface_overhead():
    """Time of a step of 256 robots of which none moves [s]: checks, the call into the core, infos.

    The least mean of many runs, which disregards what else the machine does.
    """
    env = SnakeVectorEnv(256, task="course", num_threads=1)
    env.reset(seed=0)
    env._robots.everyone = np.zeros(256, np.bool_)
    actions = np.zeros((256, 4), np.float32)
    return min(timeit.repeat(lambda: env.step(actions), number=200, repeat=50)) / 200
