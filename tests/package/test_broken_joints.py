"""Locked and limp joints: what they do by definition, and the three models against each other."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, IOLinearizing, JointTrajectory, Noise, Robot, Scene, Start

MODELS = ("planar", "spatial", "minimal")
GROUND = Scene(friction=(0.2, 0.5))
FINE = Integrator(step=1e-3)


def yaw(run, joint):
    """(T,) angle of a joint, in 3D its yaw."""
    return run.joint_angle[:, joint] if run.joint_angle.ndim == 2 else run.joint_angle[:, joint, 0]


@pytest.mark.parametrize("model", MODELS)
def test_a_locked_joint_keeps_its_angle_and_the_others_do_not(model):
    run = snake_env.simulate(model, robot=Robot(locked=(0, 4)), scene=GROUND, duration=3.0)
    for joint in (0, 4):
        np.testing.assert_allclose(
            run.joint_angle[:, joint],
            np.broadcast_to(run.joint_angle[0, joint], run.joint_angle[:, joint].shape),
            atol=5e-8,
        )
        assert np.abs(run.joint_torque[:, joint]).max() > 0.1
    assert np.ptp(yaw(run, 2)) > 1.0
    assert run.unconverged.sum() == 0


@pytest.mark.parametrize("model", MODELS)
def test_a_limp_joint_has_no_torque_and_gives_way(model):
    robot = Robot(limp=(4,))
    run = snake_env.simulate(model, robot=robot, scene=GROUND, duration=3.0, record="power")
    whole = snake_env.simulate(model, scene=GROUND, duration=3.0)
    assert not run.joint_torque[:, 4].any()
    assert not run.actuator_power[:, 4].any()
    assert np.abs(yaw(run, 4) - yaw(whole, 4)).max() > 0.1
    assert run.unconverged.sum() == 0


def test_the_models_agree_where_nothing_resists():
    """Without friction the three models are one: where they put it does not matter."""
    robot = Robot(locked=(2,), limp=(6,))
    runs = {}
    for model in MODELS:
        runs[model] = snake_env.simulate(
            model,
            robot=robot,
            scene=Scene(friction=(0.0, 0.0)),
            controller=PD(kp=800.0, kd=2.0),
            integrator=FINE,
            start=Start(position=(0.061, 0.0)),
            duration=2.0,
        )
    for model in ("spatial", "minimal"):
        np.testing.assert_allclose(runs[model].position[..., :2], runs["planar"].position, atol=2e-4)


@pytest.mark.parametrize("model", MODELS)
def test_a_lock_is_the_limit_of_a_stiff_controller(model):
    """Another way to a locked joint: all joints under stiff control, one with a constant reference."""
    gait, gains = Gait(), PD(kp=3e6, kd=6e3)
    time = np.linspace(0.0, 1.0, 401)
    begun = np.clip(time / 0.5, 0.0, 1.0)[:, None]  # at rest at first
    phase = gait.omega * time[:, None] * begun**2 * (3.0 - 2.0 * begun) + gait.beta * np.arange(10)
    angle = gait.amplitude * np.sin(phase)
    angle[:, 3] = angle[0, 3]
    controlled = JointTrajectory(time, angle)
    start = Start(posture=angle[0])
    keywords = {"scene": GROUND, "controller": gains, "start": start, "integrator": FINE, "duration": 1.0}
    locked = snake_env.simulate(model, robot=Robot(locked=(3,)), gait=controlled, **keywords)
    stiff = snake_env.simulate(model, gait=controlled, **keywords)
    np.testing.assert_allclose(locked.position, stiff.position, atol=5e-4)
    assert np.abs(yaw(locked, 3) - angle[0, 3]).max() < 5e-8


def test_held_torques_leave_locked_and_limp_joints_as_they_are():
    keywords = {"controller": PD(treatment="step"), "noise": Noise.table_7_4("b"), "duration": 0.5}
    run = snake_env.simulate("minimal", robot=Robot(locked=(5,), limp=(2,)), **keywords)
    assert np.abs(yaw(run, 5) - yaw(run, 5)[0]).max() < 5e-8
    assert not run.joint_torque[:, 2].any()


def test_torque_limits_and_switched_off_motors_do_not_open_a_lock():
    weak = PD(torque_limit=0.5, active_from=0.3)
    for model in MODELS:
        run = snake_env.simulate(model, robot=Robot(locked=(5,)), scene=GROUND, controller=weak, duration=1.0)
        assert np.abs(yaw(run, 5) - yaw(run, 5)[0]).max() < 5e-8


def test_a_lock_has_no_play_and_holds_the_force_of_a_peg():
    course = Scene.preset("table-7.5")
    run = snake_env.simulate(robot=Robot(locked=(3,), free_play=0.07), scene=course, duration=2.0)
    assert np.abs(run.contact_force).max() > 1.0
    assert np.abs(yaw(run, 3) - yaw(run, 3)[0]).max() < 2e-7


@pytest.mark.parametrize(
    ("robot", "keywords", "field"),
    [
        ({"locked": (10,)}, {}, "robot.locked[0]"),
        ({"limp": (0, -1)}, {}, "robot.limp[1]"),
        ({"locked": (3, 3)}, {}, "robot.locked[1]"),
        ({"locked": (3,), "limp": (3,)}, {}, "robot.limp[0]"),
        ({"locked": (3,)}, {"integrator": Integrator(method="thesis")}, "robot.locked"),
        ({"limp": (3,)}, {"controller": IOLinearizing()}, "robot.limp"),
        ({"locked": (3,)}, {"model": "minimal", "scene": Scene(friction_law="arctan")}, "robot.locked"),
    ],
)
def test_what_cannot_be_broken_is_refused_by_name(robot, keywords, field):
    with pytest.raises(ConfigError) as refused:
        snake_env.simulate(robot=Robot(**robot), duration=0.1, **keywords)
    assert refused.value.field == field


def test_environments_refuse_broken_joints():
    with pytest.raises(ConfigError, match="environments"):
        gymnasium.make("snake_env:SnakeFree-v1", robot=Robot(limp=(1,)))
