"""Joint velocities and torques as actions, gains, and the order of joints."""

import numpy as np
import pytest

from snake_env import PD, ConfigError, SnakeEnv, SnakeVectorEnv

STILL = {"task": "free", "start_jitter": 0.0}
IDEAL = PD(kd=0.0, torque_limit=10.0)
"""Actuators whose torque does not fall with their speed."""


def test_torques_are_those_of_the_actuators():
    """The thesis counts them the other way round."""
    env = SnakeEnv(action_mode="torques", control_period=0.005, controller=PD(kd=0.0, torque_limit=4.0), **STILL)
    env.reset(seed=0)
    action = np.linspace(-1.0, 1.0, 10)
    env.step(action)
    np.testing.assert_allclose(env.state().joint_torque, -4.0 * action, atol=1e-6)


def test_in_space_torques_are_those_of_the_actuators_joint_by_joint():
    env = SnakeEnv(model="spatial", action_mode="torques", control_period=0.005, controller=IDEAL, **STILL)
    env.reset(seed=0)
    action = np.linspace(-0.2, 0.2, 20)
    env.step(action)
    np.testing.assert_allclose(env.state().joint_torque.ravel(), -10.0 * action, atol=1e-5)


def test_a_positive_torque_increases_the_angle_of_its_joint():
    """Two links on ground without friction fold about their common CG.

    With psi = phi / 2 the CG of a link moves at l sin(psi) psi', so that (I + m l^2 sin^2 psi) phi'' = 2 tau.
    """
    options = {"controller": IDEAL, "robot": {"links": 2}, "friction": (0.0, 0.0)}
    env = SnakeEnv(action_mode="torques", control_period=0.005, **options, **STILL)
    env.reset(seed=0)
    psi = 0.5 * env.state().joint_angle[0]
    for _ in range(4):
        env.step([0.01])
    inertia = 1.32e-3 + 7.5 / 11.0 * (0.061 * np.sin(psi)) ** 2
    assert env.state().joint_rate[0] == pytest.approx(2.0 * 0.1 / inertia * 0.02, rel=0.05)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_actuators_lose_torque_with_speed_up_to_their_no_load_speed(model):
    """The torque is the action's minus kd times the rate at the end of the step, which an implicit step takes."""
    env = SnakeEnv(model=model, action_mode="torques", control_period=0.005, friction=(0.0, 0.0), **STILL)
    env.reset(seed=0)
    action = np.zeros(env.action_space.shape)
    action[4] = 0.1
    for _ in range(4):
        env.step(action)
        state = env.state()
        given = 10.0 * action - 2.0 * state.joint_rate.ravel()
        # The torque is that of the step's last stage, an instant before its end.
        np.testing.assert_allclose(-state.joint_torque.ravel(), given, atol=0.05)
    assert 0.05 < np.abs(state.joint_rate).max() < 0.5


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_work_is_torque_times_rate_where_that_is_positive_joint_by_joint(model):
    """Angles change by 1 ms of rates; the tolerance is for rates that change their sign in it."""
    envs = SnakeVectorEnv(4, model=model, action_mode="torques", control_period=0.001, controller=IDEAL, **STILL)
    envs.reset(seed=0)
    rng, expected = np.random.default_rng(0), np.zeros(4)
    for period in range(40):
        if period % 5 == 0:
            action = rng.uniform(-0.5, 0.5, envs.action_space.shape)
        before = envs.state().joint_angle
        *_, info = envs.step(action)
        turned = (envs.state().joint_angle - before).reshape(4, -1)
        expected += np.maximum(10.0 * action * turned, 0.0).sum(axis=1)
    np.testing.assert_allclose(info["energy"], expected, rtol=5e-3)
    weight = 11 * 0.6818 * 9.81
    distance = np.maximum(np.abs(info["distance"]), 0.01)
    np.testing.assert_allclose(info["cost_of_transport"], expected / weight / distance, rtol=5e-3)


def test_velocities_are_followed():
    env = SnakeEnv(action_mode="velocities", **STILL)
    env.reset(seed=0)
    action = np.zeros(10)
    action[3] = 0.2
    for _ in range(10):
        env.step(action)
    before = env.state().joint_angle
    for _ in range(4):
        env.step(action)
    rate = (env.state().joint_angle - before) / 0.2
    np.testing.assert_allclose(rate, 0.2 * np.radians(150.0) * (action > 0.0), atol=0.02)


def test_a_torque_policy_acts_alike_in_any_batch_and_thread_count():
    def run(num_envs, threads, model):
        env = SnakeVectorEnv(num_envs, num_threads=threads, model=model, action_mode="torques", control_period=0.005)
        env.reset(seed=3)
        rng = np.random.default_rng(0)
        actions = rng.uniform(-0.3, 0.3, (40, 12, env.single_action_space.shape[0]))
        return np.stack([env.step(action[:num_envs])[0][:2] for action in actions])

    for model in ("planar", "spatial"):
        np.testing.assert_array_equal(run(12, 2, model), run(12, 1, model))
        np.testing.assert_array_equal(run(12, 2, model), run(2, 1, model))


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"controller": PD(torque_limit=None)}, "controller.torque_limit"),
        ({"controller": "io"}, "controller.law"),
        ({"robot": {"backlash": 0.05}}, "robot.backlash"),
    ],
)
def test_what_torques_cannot_go_with_is_refused_by_name(options, field):
    with pytest.raises(ConfigError, match=field):
        SnakeEnv(action_mode="torques", **options)


def test_joints_have_one_order_in_action_observation_and_state():
    """Each entry moves the element of the observation and of the state at the same place."""
    env = SnakeEnv(model="spatial", action_mode="joints", **STILL)
    names = [entry["name"] for entry in env.layout["action"]]
    block = next(block for block in env.layout["observation"] if block["name"] == "joint_angle")
    assert names == block["elements"]
    for place in (6, 9):
        env.reset(seed=0)
        before = env.state().joint_angle.ravel()
        action = before / np.radians(np.tile([70.0, 45.0], 10))
        action[place] += 0.4
        for _ in range(12):
            env.step(action)
        moved = np.abs(env.state().joint_angle.ravel() - before)
        assert moved.argmax() == place
