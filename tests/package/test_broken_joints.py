"""Locked and limp joints: what they do by definition, and the three models against each other."""

from __future__ import annotations

import numpy as np
import pytest

import snake_env
from snake_env import (
    PD,
    ConfigError,
    Gait,
    Integrator,
    IOLinearizing,
    JointTrajectory,
    Noise,
    Robot,
    Scene,
    SnakeEnv,
    SnakeVectorEnv,
    Start,
)

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
    """Another way to a locked joint: all joints under stiff control, one with a constant reference.

    The gains are so high because the limit is slow in 3D, where the model leaves open how links share loads.
    """
    gait, gains = Gait(), PD(kp=1e7, kd=2e4)
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
    run = snake_env.simulate(robot=Robot(locked=(3,), backlash=0.07), scene=course, duration=2.0)
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


@pytest.mark.parametrize("mode", ["gait", "joints", "residual", "velocities", "torques"])
@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_broken_joints_of_environments_are_held_or_let_go_whatever_the_actions_are(model, mode):
    """Each robot keeps the angle of its own start."""
    options = {"model": model, "task": "field", "action_mode": mode, "randomization": {"backlash": (0.0, 0.05)}}
    if mode == "torques":
        options.pop("randomization")
    env = SnakeVectorEnv(3, robot=Robot(locked=(0, 4), limp=(7,)), **options)
    env.action_space.seed(0)
    for seed in (1, 2):
        env.reset(seed=seed)
        at_start = env.state().joint_angle[:, [0, 4]]
        states, pressed, moved = env.get_state(), [], []
        for _ in range(25):
            env.step(env.action_space.sample())
            state = env.state()
            np.testing.assert_allclose(state.joint_angle[:, [0, 4]], at_start, atol=2e-6)
            assert not state.joint_torque[:, 7].any()
            pressed.append(state.joint_torque[:, [0, 4]])
            moved.append(state.joint_angle[:, 5])
        assert np.abs(pressed).max() > 0.1
        assert np.ptp(moved, axis=0).max() > 0.05
    env.set_state(states)
    np.testing.assert_array_equal(env.state().joint_angle[:, [0, 4]], at_start)
    env.step(env.action_space.sample())
    np.testing.assert_allclose(env.state().joint_angle[:, [0, 4]], at_start, atol=2e-6)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_an_environment_with_broken_joints_is_the_run_with_them(model):
    """Actions that hold the posture of the start, as the reference of a run does; single precision has them exactly."""
    # What stages leave open moves the ends of parts of free length and, in 3D, limp links by millimetres: equal steps.
    integrator = Integrator(order=1, step=5e-3) if model == "spatial" else Integrator()
    options = {"model": model, "task": "free", "action_mode": "joints", "integrator": integrator}
    entries = SnakeEnv(**options).layout["action"]
    rest = np.array([0.0 if "pitch" in entry["name"] else 0.0625 * k - 0.25 for k, entry in enumerate(entries)])
    angle = np.array(
        [
            entry["low"] + 0.5 * (1.0 + x) * (entry["high"] - entry["low"])
            for x, entry in zip(rest, entries, strict=True)
        ]
    )
    angle = angle.reshape((10, 2) if model == "spatial" else 10)
    robot, friction = Robot(locked=(2,), limp=(5, 6)), (0.1, 0.3)
    start = Start(position=(0.0, 0.0), heading=2.0, posture=angle)
    env = SnakeEnv(robot=robot, start=start, friction=friction, slope=(0.5, 0.0), **options)
    env.reset(seed=0)
    for _ in range(10):
        env.step(rest)
    run = snake_env.simulate(
        model,
        robot=robot,
        start=start,
        scene=Scene(friction=friction, slope=(0.5, 0.0)),
        gait=JointTrajectory([0.0, 1.0], [angle, angle]),
        controller=PD(torque_limit=10.0),
        duration=0.5,
        sample=0.05,
        integrator=integrator,
    )
    # The stages of half a second end within 1e-6 m/s of their solutions; the plane has no other differences.
    tolerance = 5e-6 if model == "spatial" else 1e-9
    np.testing.assert_allclose(env.state().link_position, run.position[-1], atol=tolerance)
    np.testing.assert_allclose(env.state().joint_angle, run.joint_angle[-1], atol=10 * tolerance)
    block = next(block for block in env.layout["observation"] if block["name"] == "reference")
    observed = env.step(rest)[0][block["start"] : block["start"] + block["size"]] * block["scale"]
    np.testing.assert_allclose(observed.reshape(angle.shape)[2], angle[2], atol=1e-6)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"robot": Robot(limp=(3,)), "controller": IOLinearizing()}, "robot.limp"),
        ({"robot": {"links": 3, "limp": (2,)}}, "robot.limp[0]"),
    ],
)
def test_environments_refuse_what_runs_refuse(options, field):
    with pytest.raises(ConfigError) as refused:
        SnakeEnv(task="free", **options)
    assert refused.value.field == field
