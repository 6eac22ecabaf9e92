"""Motors of the joints: what a user configures, sees and gets refused."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from conftest import advance, in_mujoco

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, Motor, Robot, Scene, Start

WEAK = Motor(stall_torque=3.0, no_load_speed=2.0)
FAST = Gait.lateral_undulation(omega=np.radians(160))
GROUND = Scene(friction=(0.2, 0.5))


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_torque_and_power_stay_below_the_line(model):
    run = snake_env.simulate(
        model, robot=Robot(motor=WEAK), gait=FAST, scene=GROUND, duration=3.0, record=("velocity",)
    )
    assert run.unconverged.sum() == 0
    torque, rate = -run.joint_torque, run.joint_rate
    line = np.maximum(3.0 * (1.0 - np.abs(rate) / 2.0), 0.0)
    driving = torque * rate > 0.0
    assert (np.abs(torque) < line + 1e-6)[driving].all()
    assert ((np.abs(torque) > line - 1e-6) & (line < 2.9) & (line > 0.0))[driving].any(), "the line must be met"
    assert 0.5 < run.motor_power.max() < 1.5
    # Heat is torque^2 times the slope of the line.
    assert (run.electrical_power >= run.motor_power).all()
    free = snake_env.simulate(model, gait=FAST, scene=GROUND, duration=3.0, record=("power",))
    assert free.motor_power is None
    assert free.actuator_power.max() > 3.0


def test_heat_follows_the_torque_of_a_motor_that_holds():
    """A gear without friction holds a bent joint against the ground's friction by torque alone."""
    bent = Start(posture=[0.5] * 10)
    hold = Gait.lateral_undulation(amplitude=0.0, gamma=0.6)
    run = snake_env.simulate(
        robot=Robot(motor=WEAK), controller=PD(kp=5.0, kd=5.0), gait=hold, start=bent, duration=20.0
    )
    assert np.abs(run.motor_power[-1]).max() < 1e-6
    heat = run.joint_torque[-1] ** 2 * WEAK.no_load_speed / WEAK.stall_torque
    np.testing.assert_allclose(run.electrical_power[-1], heat, rtol=1e-4, atol=1e-9)
    assert heat.max() > 1e-3


def test_a_robot_without_motor_has_none_of_it():
    run = snake_env.simulate(duration=0.2)
    assert run.motor_power is None
    assert run.electrical_power is None


@pytest.mark.parametrize("action_mode", ["gait", "joints", "torques"])
@pytest.mark.parametrize("env_id", ["SnakeField-v1", "SnakeSpatial-v1"])
def test_environments_report_power_and_count_what_motors_draw(env_id, action_mode):
    motor = Motor(stall_torque=4.0, no_load_speed=3.0, rotor_inertia=1e-6, gear_ratio=50.0, gear_friction=0.1)
    totals = {}
    for energy in ("mechanical", "electrical"):
        envs = gymnasium.make_vec(env_id, num_envs=3, robot=Robot(motor=motor), energy=energy, action_mode=action_mode)
        envs.reset(seed=0)
        envs.action_space.seed(0)
        drawn, done = np.zeros(3), np.zeros(3)
        for _ in range(20):
            info = envs.step(envs.action_space.sample())[-1]
            drawn += envs.unwrapped.control_period * info["electrical_power"]
            done += info["positive_work"]
            assert not info["unconverged"].any()
            assert (info["motor_power"] <= info["electrical_power"] + 1e-9).all()
        totals[energy] = info["energy"]
        expected = drawn if energy == "electrical" else done
        np.testing.assert_allclose(info["energy"], expected, rtol=1e-9)
        envs.close()
    assert (totals["electrical"] > 1.5 * totals["mechanical"]).all()


def test_torques_as_actions_reach_the_stall_torque():
    """The largest torque of an action is the motor's."""
    envs = gymnasium.make_vec("SnakeFree-v1", num_envs=1, robot=Robot(motor=WEAK), action_mode="torques")
    envs.reset(seed=0)
    envs.step(np.full((1, 10), 1.0, np.float32))
    assert np.abs(envs.unwrapped.state().joint_torque).max() <= 3.0 + 1e-9
    envs.close()


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_motors_of_all_joints_are_those_of_each(model):
    motor = Motor(stall_torque=3.0, no_load_speed=2.0, rotor_inertia=1e-3, gear_friction=0.1)
    options = {"gait": FAST, "scene": GROUND, "duration": 0.5, "record": ("power",)}
    alike, each = (snake_env.simulate(model, robot=Robot(motor=m), **options) for m in (motor, [motor] * 10))
    np.testing.assert_array_equal(each.joint_angle, alike.joint_angle)
    np.testing.assert_array_equal(each.electrical_power, alike.electrical_power)


def test_each_joint_stays_below_the_line_of_its_own_motor(tmp_path):
    strong = Motor(stall_torque=6.0, no_load_speed=5.0)
    robot = Robot(motor=[WEAK] * 5 + [strong] * 4 + [Motor()])
    rough = Scene(friction=(0.8, 2.0))
    run = snake_env.simulate(robot=robot, gait=FAST, scene=rough, duration=2.0, record=("velocity",))
    torque, rate = -run.joint_torque, run.joint_rate
    driving = torque * rate > 0.0
    for joints, motor in ((slice(5), WEAK), (slice(5, 9), strong)):
        line = np.maximum(motor.stall_torque * (1.0 - np.abs(rate[:, joints]) / motor.no_load_speed), 0.0)
        below = np.abs(torque[:, joints]) < line + 1e-6
        assert below[driving[:, joints]].all()
    assert np.abs(torque[:, 5:9]).max() > 3.0, "the strong ones must give more than a weak one can"
    run.save(tmp_path / "run.npz")
    assert snake_env.load_trajectory(tmp_path / "run.npz").robot == robot
    envs = gymnasium.make_vec("SnakeFree-v1", num_envs=1, robot={"motor": [{"stall_torque": 2.0}, *[strong] * 9]})
    assert envs.unwrapped.layout["config"]["robot"]["motor"][0]["stall_torque"] == 2.0
    envs.close()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"motor": [WEAK] * 9}, r"robot\.motor = 9 entries: expected .*10 entries \(one per joint\)"),
        ({"motor": [(WEAK, WEAK)] * 10, "axes": "yaw"}, r"robot\.motor\[0\] = 2 values: .*joint with both axes"),
        ({"motor": [WEAK] * 9 + [3.0]}, r"robot\.motor = .*expected a snake_env\.Motor"),
        ({"motor": []}, r"robot\.motor = \[\]: expected a snake_env\.Motor"),
        (
            {"motor": [WEAK] * 9 + [Motor(gear_friction=1.0)], "backlash": [0.0] * 9 + [0.1]},
            r"robot\.backlash = 0\.1: expected 0",
        ),
    ],
)
def test_motors_that_joints_cannot_have_are_named(fields, message):
    with pytest.raises(ConfigError, match=message):
        Robot(**fields)
    if "backlash" in fields:
        Robot(motor=fields["motor"], backlash=[0.1] * 9 + [0.0])


def test_saved_runs_keep_motors(tmp_path):
    motor = Motor(stall_torque=4.0, no_load_speed=3.0, rotor_inertia=1e-3, gear_friction=0.4)
    run = snake_env.simulate(robot=Robot(motor=motor), duration=0.3)
    run.save(tmp_path / "run.npz")
    again = snake_env.load_trajectory(tmp_path / "run.npz")
    assert again.robot == run.robot
    np.testing.assert_array_equal(again.electrical_power, run.electrical_power)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Motor(stall_torque=0.0, no_load_speed=1.0), r"motor.stall_torque = 0"),
        (lambda: Motor(stall_torque=1.0, no_load_speed=np.nan), r"motor.no_load_speed = nan"),
        (lambda: Motor(gear_damping=-1.0), r"motor.gear_damping = -1"),
        (lambda: Motor(no_load_speed=2.0), r"motor.stall_torque = inf: .* no_load_speed"),
        (lambda: Motor(stall_torque=1e-300), r"motor.stall_torque = 1e-300"),
        (lambda: Motor(1.0, no_load_speed=1e300), r"motor.no_load_speed = 1e\+?300"),
        (lambda: Motor(stall_torque=1.0, no_load_speed=1.0, rotor_inertia=-1.0), r"motor.rotor_inertia = -1"),
        (lambda: Motor(stall_torque=1.0, no_load_speed=1.0, gear_ratio=0.0), r"motor.gear_ratio = 0"),
        (lambda: Motor(stall_torque=1.0, no_load_speed=1.0, gear_friction=np.nan), r"motor.gear_friction = nan"),
        (lambda: Robot(motor=3), r"robot.motor = 3"),
        (lambda: Robot(motor={"stall_torque": 1.0}), r"robot.motor = .*snake_env.Motor"),
        (lambda: Robot.of({"motor": {"stall": 1.0}}), r"robot.motor.stall"),
        (lambda: Robot(motor=Motor(1.0, 1.0, gear_friction=0.1), backlash=0.1), r"robot.backlash = 0.1"),
        (lambda: snake_env.simulate("minimal", robot=Robot(motor=WEAK)), r"robot.motor"),
        (lambda: snake_env.simulate(robot=Robot(motor=WEAK), integrator=Integrator(method="thesis")), r"robot.motor"),
        (lambda: gymnasium.make_vec("SnakeField-v1", num_envs=1, energy="electrical"), r'energy = "electrical"'),
        (
            lambda: gymnasium.make_vec(
                "SnakeField-v1",
                num_envs=1,
                robot=Robot(motor=Motor(1.0, 1.0, rotor_inertia=1e-3)),
                randomization={"backlash": (0.0, 0.05)},
            ),
            r"randomization.backlash",
        ),
    ],
)
def test_what_is_not_admissible_is_named(make, field):
    with pytest.raises(ConfigError, match=field):
        make()


def test_presets_are_what_their_sources_say():
    aiko, servo = Motor.aiko(), Motor.xh430()
    assert 0.25 * aiko.stall_torque * aiko.no_load_speed == pytest.approx(6.0)
    assert (servo.stall_torque, servo.gear_ratio) == (3.4, 353.5)
    assert servo.no_load_speed == pytest.approx(np.pi)
    assert Motor.aiko(stall_torque=2.0).stall_torque == 2.0


def test_the_line_is_left_out_of_a_model_of_mujoco():
    pytest.importorskip("mujoco")
    with pytest.warns(UserWarning, match="torque-speed line") as caught:
        document = Scene().to_mjcf(robot=Robot(motor=WEAK))
    assert caught[0].filename == __file__
    assert 'forcerange="-3.0 3.0"' in document or 'forcerange="-3 3"' in document


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_motor_without_limits_changes_nothing(model):
    plain, driven = (snake_env.simulate(model, robot=Robot(motor=motor), duration=0.5) for motor in (None, Motor()))
    np.testing.assert_array_equal(driven.position, plain.position)
    assert (driven.electrical_power >= driven.motor_power).all()


def test_rotor_and_gear_move_as_in_mujoco():
    """In free flight at small steps."""
    motor = Motor(rotor_inertia=2e-5, gear_ratio=10.0, gear_friction=0.3, gear_damping=0.03)
    robot = Robot(links=4, gravity=1e-6, motor=motor, axes=["yaw", "pitch", "yaw"], self_contact=False)
    controller, scene = PD(kp=8.0, kd=0.05), Scene(friction=(0.0, 0.0))
    start = Start(posture="straight", position=(0.0, 0.0, 9.0))
    model, data = in_mujoco(scene, robot=robot, controller=controller, start=start, step=1e-4)
    target = np.array([0.5, -0.4, 0.3])
    data.ctrl[:] = target
    angles = []
    for _ in range(6):
        angles.append(data.qpos[7:].copy())
        advance(model, data, 0.1)
    held = snake_env.JointTrajectory(time=[0.0, 1.0], angle=np.tile(target, (2, 1)))
    run = snake_env.simulate(
        "spatial",
        robot=robot,
        controller=controller,
        scene=scene,
        start=start,
        gait=held,
        duration=0.5,
        integrator=Integrator(step=1e-4),
    )
    np.testing.assert_allclose(run.joint_angle, angles, atol=3e-4)
    assert np.abs(run.joint_angle).max() > 0.3
