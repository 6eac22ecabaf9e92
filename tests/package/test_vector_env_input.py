"""What a batch is given is checked when it is made, reset and stepped; what is not admissible is named."""

from __future__ import annotations

import gc

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded

import snake_env
from snake_env import ConfigError, SnakeEnv, SnakeVectorEnv
from snake_env.testing import assert_identical


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
    with pytest.raises(ConfigError, match=r"^options = \[1\]: expected None or a mapping"):
        make(num_envs=2).reset(options=[1])
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
@pytest.mark.parametrize(("model", "robot", "element"), [("planar", 1, 2), ("spatial", 2, 5)])
def test_an_action_that_is_not_finite_names_robot_and_element(make, value, model, robot, element):
    env = make(num_envs=3, model=model)
    env.reset(seed=0)
    actions = np.zeros(env.action_space.shape)
    actions[robot, element] = value
    with pytest.raises(ConfigError, match=rf"action\[{robot}, {element}\] = .*: expected a finite number"):
        env.step(actions)
    env.step(np.zeros(env.action_space.shape))


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
        ({"max_episode_steps": True}, "max_episode_steps"),
        ({"reward_fn": 3}, "reward_fn"),
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


@pytest.mark.parametrize(("given", "limit"), [(None, 600), (-1, None), (605, 605)])
def test_step_limits_mean_what_they_mean_to_gymnasium(given, limit):
    options = {"goal_distance": 20.0, "corridor_half_width": 5.0, "max_episode_steps": given}
    ends = []
    for mode in ("vector_entry_point", "sync"):
        env = gym.make_vec("SnakeFree-v1", num_envs=1, vectorization_mode=mode, **options)
        env.reset(seed=0)
        truncated = [bool(env.step(np.zeros((1, 4)))[3][0]) for _ in range(606)]
        ends.append(truncated.index(True) + 1 if any(truncated) else None)
    assert ends == [limit, limit]


def test_the_message_about_a_step_limit_names_what_is_admissible():
    for bad in (0, -5, 2.5):
        with pytest.raises(ConfigError, match=r"an integer >= 1, None, or -1 for no limit"):
            SnakeEnv(task="field", max_episode_steps=bad)


def test_a_refused_call_changes_nothing(make):
    env = make(num_envs=2)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"^difficulty = 7"):
        env.set_difficulty([0.9, 7.0])
    assert env.difficulty.tolist() == [0.5, 0.5]
    env.step(np.ones((2, 4)))
    states = env.get_state()
    env.step(np.ones((2, 4)))
    after = env.get_state()
    with pytest.raises(ConfigError, match=r"^state = "):
        env.set_state([states[0], states[1]._replace(core=b"nonsense")])
    assert [state.core for state in env.get_state()] == [state.core for state in after]


def test_attributes_that_nothing_would_heed_cannot_be_set(make):
    env = make(num_envs=2)
    for name in ("control_period", "num_threads", "layout", "reward_fn", "scene", "autoreset_mode"):
        with pytest.raises(AttributeError):
            setattr(env, name, 2)
    env.difficulty = 0.75
    assert env.difficulty.tolist() == [0.75, 0.75]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_each_mask_of_the_infos_is_an_array_of_its_own(make, mode):
    env = make(num_envs=2, max_episode_steps=1, autoreset_mode=mode)
    results = [env.reset(seed=0)[1], env.step(np.zeros((2, 4)))[4]]
    results += [infos["final_info"] for infos in results if "final_info" in infos]
    for infos in results:
        masks = [mask for name, mask in infos.items() if name.startswith("_")]
        for k, mask in enumerate(masks):
            assert not any(np.shares_memory(mask, other) for other in masks[:k])


def test_sections_may_be_dataclasses_or_mappings():
    one = SnakeVectorEnv(2, task="free", robot=snake_env.Robot(links=5), controller=snake_env.PD(torque_limit=3.0))
    other = SnakeVectorEnv(2, task="free", robot={"links": 5}, controller={"torque_limit": 3.0})
    assert_identical(one.reset(seed=0), other.reset(seed=0), "dataclass and mapping")


def test_step_needs_a_reset_first(make):
    with pytest.raises(ResetNeeded):
        make(num_envs=2).step(np.zeros((2, 4)))
    with pytest.raises(ResetNeeded):
        make(num_envs=2, autoreset_mode="Disabled").reset(options={"reset_mask": np.array([True, False])})


def test_a_closed_environment_is_an_error(make):
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
