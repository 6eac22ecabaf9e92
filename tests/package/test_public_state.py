"""The state and the scene of robots, against what other parts of the package say about them."""

from __future__ import annotations

import copy
import dataclasses

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start, State
from snake_env.obstacles import Segment
from snake_env.testing import assert_identical, check_vector_env

SPATIAL = {"model": "spatial", "task": "free"}


def driven(env, steps=40):
    """The environment after a while of the gait that action zero is."""
    env.reset(seed=0)
    for _ in range(steps):
        env.step(np.zeros(env.action_space.shape, np.float32))
    return env


def test_the_arrays_have_the_documented_shapes(env_id):
    env = gym.make_vec(env_id, num_envs=3)
    env.reset(seed=0)
    state, links = env.unwrapped.state(), 11
    in_space = env.layout["config"]["model"] == "spatial"
    axes, per_joint = (3, (2,)) if in_space else (2, ())
    assert state.time.shape == state.energy.shape == state.goal_radius.shape == (3,)
    for name in ("link_position", "link_velocity", "contact_force", "self_contact_force"):
        assert getattr(state, name).shape == (3, links, axes), name
    for name in ("joint_angle", "joint_rate", "joint_torque"):
        assert getattr(state, name).shape == (3, links - 1, *per_joint), name
    assert (state.link_angle is None) == in_space
    assert (state.link_quaternion is None) != in_space
    assert state.link_half_length.shape == state.link_radius.shape == state.link_cg_offset.shape == (links,)
    for name, array in state.arrays().items():
        assert array.dtype == np.float64, name
        assert array.flags.c_contiguous, name
        if name in ("obstacles", "obstacle_position", "obstacle_angle", "obstacle_height", "obstacle_force", "path"):
            continue
        has_no_end = env_id == "SnakeCommand-v1" and name in ("goal", "goal_radius")
        assert np.isfinite(array).all() != has_no_end, name


def test_the_layout_describes_what_the_state_holds(env_id):
    env = gym.make_vec(env_id, num_envs=2)
    described = {row["name"]: (2, *row["shape"]) for row in env.unwrapped.layout["state"]}
    described |= dict.fromkeys(("link_half_length", "link_radius", "link_cg_offset"), (11,))
    env.reset(seed=0)
    found = {name: array.shape for name, array in env.unwrapped.state().arrays().items()}
    assert found.pop("obstacles")[0::2] == (2, 3)
    assert found.pop("obstacle_force")[0::2] == (2, 2 if env.unwrapped.layout["config"]["model"] == "planar" else 3)
    assert found["obstacle_position"] == (*found["obstacle_angle"], 2)
    assert found.pop("obstacle_height") == found.pop("obstacle_angle")
    assert found.pop("obstacle_position")[0::2] == (2, 2)
    assert found.pop("path") == (2, 0, 2)
    assert found == described
    assert set(described) <= {one.name for one in dataclasses.fields(State)}


@pytest.mark.parametrize("options", [{"task": "course"}, SPATIAL])
def test_links_and_joints_agree(options):
    """Neighbouring links meet in their joint; joint angles and rates are differences of those of the links."""
    state = driven(SnakeVectorEnv(2, **options)).state()
    half = 0.5 * Robot().length
    ends = state.link_position[:, :-1] + half * state.link_axis[:, :-1]
    np.testing.assert_allclose(ends, state.link_position[:, 1:] - half * state.link_axis[:, 1:], atol=1e-6)
    if state.link_angle is not None:
        np.testing.assert_allclose(np.diff(state.link_angle), state.joint_angle, atol=1e-12)
        np.testing.assert_allclose(np.diff(state.link_angular_velocity), state.joint_rate, atol=1e-12)


@pytest.mark.parametrize("options", [{"task": "course"}, SPATIAL])
def test_velocities_are_those_of_the_positions(options):
    """Over a millisecond a mean velocity and the last one differ by the acceleration."""
    env = driven(SnakeVectorEnv(1, control_period=0.001, **options), 400)
    before = env.state()
    env.step(np.zeros(env.action_space.shape))
    after = env.state()
    moved = (after.link_position - before.link_position) / 0.001
    assert np.abs(after.link_velocity).max() > 0.01
    np.testing.assert_allclose(moved, after.link_velocity, atol=0.02)
    np.testing.assert_allclose((after.position - before.position) / 0.001, after.velocity, atol=0.02)


def test_the_state_agrees_with_the_observation_and_the_infos():
    env = SnakeVectorEnv(3, task="field")
    driven(env)
    observation, _, _, _, infos = env.step(np.zeros((3, 4)))
    state = env.state()
    blocks = {block["name"]: block for block in env.layout["observation"]}

    def observed(name):
        block = blocks[name]
        return observation[:, block["start"] : block["start"] + block["size"]] * block["scale"]

    np.testing.assert_allclose(observed("joint_angle"), state.joint_angle, atol=1e-6)
    np.testing.assert_allclose(observed("joint_rate"), state.joint_rate, atol=1e-5)
    np.testing.assert_array_equal(infos["time"], state.time)
    np.testing.assert_array_equal(infos["distance"], state.distance)
    np.testing.assert_array_equal(infos["contacts"], (state.contact_force != 0.0).any(axis=2).sum(axis=1))
    assert infos["contacts"].any()
    left = -np.stack([-np.sin(state.link_angle), np.cos(state.link_angle)], axis=-1)
    pushes = np.clip((left * state.contact_force).sum(axis=-1), -80.0, 80.0)
    np.testing.assert_allclose(observed("contact_force"), pushes, atol=1e-4)


def test_energy_and_torque_are_those_of_the_links():
    robot, state = Robot(), driven(SnakeVectorEnv(2, task="free")).state()
    translation = 0.5 * robot.mass * np.square(state.link_velocity).sum(axis=(1, 2))
    rotation = 0.5 * robot.inertia * np.square(state.link_angular_velocity).sum(axis=1)
    np.testing.assert_allclose(state.energy, translation + rotation, rtol=1e-12)
    assert 0.0 < np.abs(state.joint_torque).max() <= 10.0


def test_in_space_the_ground_carries_the_weight():
    """At rest the normal forces add up to the weight of the robot."""
    env = SnakeEnv(action_mode="joints", start_jitter=0.0, **SPATIAL)
    env.reset(seed=0)
    weight = Robot().mass * 11 * 9.81
    for _ in range(20):
        env.step(np.zeros(20))
    assert env.state().normal_force.sum() == pytest.approx(weight, rel=0.05)


@pytest.mark.parametrize(("task", "is_disc"), [("field", False), ("maze", True)])
def test_the_goal_is_where_success_is(task, is_disc):
    env = SnakeVectorEnv(2, task=task, goal_distance=1.5, goal_radius=0.3, start_jitter=0.0)
    env.reset(seed=0)
    state = env.state()
    assert (state.goal_radius > 0.0).all() == is_disc
    distance = np.hypot(*(state.goal - state.position).T) if is_disc else state.goal[:, 0] - state.position[:, 0]
    np.testing.assert_allclose(distance, 1.5, atol=1e-9)
    assert (state.corridor_half_width == 0.8).all()


def test_a_single_environment_has_no_first_axis():
    batch, single = SnakeVectorEnv(3, task="field"), SnakeEnv(task="field")
    batch.reset(seed=0)
    single.reset(seed=2)
    assert_identical(single.state().arrays(), batch.state().robot(2).arrays(), "robot 2")
    assert single.scene() == batch.scene(2)


def test_the_scene_is_the_one_that_robots_run_in():
    course = SnakeVectorEnv(2, task="course", friction=(0.2, 0.3), stribeck={"drop": 0.2, "speed": 0.1})
    course.reset(seed=0)
    scene = course.scene(1)
    assert scene.obstacles[:7] == Scene.preset("table-7.5").obstacles
    assert (scene.friction, scene.stribeck.drop) == ((0.2, 0.3), 0.2)
    field = SnakeVectorEnv(2, task="field")
    field.reset(seed=0)
    assert field.scene(0) != field.scene(1)


def test_states_are_copies_that_nothing_changes_later():
    env = driven(SnakeVectorEnv(2, task="course"))
    kept = env.state()
    before = copy.deepcopy(kept.arrays())
    env.step(np.ones((2, 4)))
    assert_identical(kept.arrays(), before, "a kept state")
    kept.link_position[:] = 0.0
    assert (env.state().link_position != 0.0).any()


def test_a_restored_robot_has_the_same_state():
    env = driven(SnakeVectorEnv(2, task="course"))
    expected, saved = env.state(), env.get_state()
    driven(env, 3)
    env.set_state(saved)
    assert_identical(env.state().arrays(), expected.arrays(), "after set_state")


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_forces_of_obstacles_add_up_to_those_on_links(model):
    """Each force acts on one link and comes from one obstacle."""
    env = driven(SnakeVectorEnv(2, task="course", model=model), 25)
    state = env.state()
    assert state.obstacle_force.shape == (2, len(env.scene(0).obstacles), 3 if model == "spatial" else 2)
    total = state.contact_force.sum(axis=1)
    assert np.abs(total).max() > 1.0
    np.testing.assert_allclose(state.obstacle_force.sum(axis=1), total, atol=1e-9)


def test_forces_of_obstacles_come_in_the_order_of_the_scene():
    """A wall between two pegs of the scene carries a robot that lies on it and slides down a slope."""
    wall = Segment((-9.0, 0.0), (9.0, 0.0))
    scene = Scene(obstacles=[(0.1, 5.0, 3.0), wall, (0.1, 5.0, 4.0)], friction=(0.0, 0.0), slope=(0.6, 0.5 * np.pi))
    lying = Start(position=(0.0, 0.0526), heading=0.0, posture="straight")
    env = SnakeEnv(task="field", scene=scene, start=lying, action_mode="joints")
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.zeros(10))
    weight = 11 * Robot().mass * 9.81 * np.sin(0.6)
    np.testing.assert_allclose(env.state().obstacle_force, [[0.0, 0.0], [0.0, weight], [0.0, 0.0]], atol=0.02 * weight)
    assert env.state().obstacles.shape == (2, 3)


def test_the_infos_have_the_state_on_request():
    names = ["link_position", "time"]
    options = {"task": "field", "info_state": names, "max_episode_steps": 5}
    check_vector_env(lambda **given: SnakeVectorEnv(**options, **given), lambda: SnakeEnv(**options), steps=12)
    env = SnakeVectorEnv(3, **options)
    infos = env.reset(seed=0)[1]
    np.testing.assert_array_equal(infos["state"]["link_position"], env.state().link_position)
    *_, infos = env.step(np.zeros((3, 4)))
    np.testing.assert_array_equal(infos["state"]["link_position"], env.state().link_position)
    assert "state" not in SnakeVectorEnv(3, task="field").reset(seed=0)[1]


@pytest.mark.parametrize("names", ["time", 3, ["smell"], ["obstacles"]])
def test_names_of_the_state_that_infos_cannot_have_are_refused(names):
    with pytest.raises(ConfigError, match=r"^info_state"):
        SnakeEnv(info_state=names)
