"""Joints with chosen axes: shapes, errors, references, environments, and flight against MuJoCo."""

from __future__ import annotations

import dataclasses

import gymnasium as gym
import numpy as np
import pytest
from conftest import advance, in_mujoco

from snake_env import PD, ConfigError, Gait, Integrator, JointTrajectory, Robot, Scene, Start, simulate

ALTERNATING = ("yaw", "pitch") * 3
MIXED = ("yaw", "roll", "both", "pitch", (1.0, 2.0, 3.0), "yaw")


def run(axes, **options):
    return simulate(model="spatial", robot=Robot(links=7, axes=axes), duration=0.2, sample=0.1, **options)


def test_trajectories_list_the_axes_that_there_are():
    cardan, hinges = run("both", record=("velocity", "power")), run(MIXED, record=("velocity", "power"))
    columns = ("joint_angle", "joint_torque", "joint_rate", "actuator_power")
    assert [getattr(cardan, name).shape for name in columns] == [(3, 6, 2)] * 4
    assert [getattr(hinges, name).shape for name in columns] == [(3, 7)] * 4
    assert hinges.axes == [(0, "yaw"), (1, "roll"), (2, "yaw"), (2, "pitch"), (3, "pitch"), (4, MIXED[4]), (5, "yaw")]
    assert cardan.axes[:3] == [(0, "yaw"), (0, "pitch"), (1, "yaw")]
    planar = simulate(robot=Robot(links=7, axes="yaw"), duration=0.1)
    assert planar.joint_angle.shape == (2, 6)
    assert planar.axes == [(joint, "yaw") for joint in range(6)]


def test_a_list_of_cardan_joints_moves_as_they_do_by_default():
    gait, cardan = Gait.sidewinding(), {"model": "spatial", "duration": 0.5}
    default, listed = (simulate(robot=Robot(axes=axes), gait=gait, **cardan) for axes in ("both", ["both"] * 10))
    np.testing.assert_array_equal(default.position, listed.position)
    np.testing.assert_array_equal(default.joint_angle.reshape(len(default.time), -1), listed.joint_angle)


@pytest.mark.parametrize("delay", [0.0, 0.05])
def test_waves_drive_the_axes_across_the_robot(delay):
    gait = Gait(amplitude=0.3, vertical_amplitude=0.2, vertical_omega=1.0)
    hinges = run(MIXED, gait=gait, reference_delay=delay)
    time = np.maximum(hinges.time - delay, 0.0)
    yaw, pitch = (gait.reference(time, vertical=vertical, joints=6)["angle"] for vertical in (False, True))
    columns = {"yaw": yaw, "pitch": pitch}
    for angle, (joint, axis) in zip(hinges.joint_angle.T, hinges.axes, strict=True):
        if axis == "roll" or joint == 4:
            assert np.abs(angle).max() < 5e-3
        else:
            np.testing.assert_allclose(angle, columns[axis][:, joint], atol=2e-2)


def test_vertical_waves_drive_pitch_about_the_opposite_vector():
    gait = Gait(amplitude=0.0, vertical_amplitude=0.2, vertical_omega=4.0)
    start = Start(posture="straight", position=(0.0, 0.0, 9.0))
    named, opposite = (run(axes, gait=gait, start=start) for axes in ("pitch", [(-2.0, 0.0, 0.0)] * 6))
    assert np.abs(named.joint_angle).max() > 0.1
    np.testing.assert_allclose(opposite.joint_angle, named.joint_angle, atol=1e-9)
    # The bend is the other way round.
    np.testing.assert_allclose(opposite.joint_torque, named.joint_torque, atol=1e-9)
    heights = [one.position[..., 2] - one.position[..., 2].mean(axis=1, keepdims=True) for one in (named, opposite)]
    np.testing.assert_allclose(heights[0], -heights[1], atol=1e-6)


def test_axes_follow_angles_of_their_own():
    wanted = 0.1 * np.arange(1.0, 8.0)
    gait = JointTrajectory([0.0, 1.0], [wanted, wanted])
    still = Scene(friction=(0.0, 0.0), rolling_friction=0.0)
    held = run(MIXED, gait=gait, start=Start(posture=wanted, position=(0.0, 0.0, 9.0)), scene=still)
    np.testing.assert_allclose(held.joint_angle, np.tile(wanted, (3, 1)), atol=1e-3)
    again = run(MIXED, gait=gait, start=Start(posture=held.joint_angle[-1], position=(0.0, 0.0, 9.0)), scene=still)
    np.testing.assert_allclose(again.joint_angle[0], held.joint_angle[-1], atol=1e-12)
    with pytest.raises(ConfigError, match=r"gait\.angle = 6 angles: expected 7 angles, one per axis"):
        run(MIXED, gait=JointTrajectory([0.0, 1.0], np.zeros((2, 6))))
    with pytest.raises(ConfigError, match=r"start\.posture = .*7 angles, one per axis"):
        run(MIXED, start=Start(posture=[0.0] * 6))


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        (["yaw"] * 5, r"robot\.axes = 5 entries: expected \"both\", or a list of 6 entries \(one per joint\)"),
        ([*["yaw"] * 5, (0, 0, 0)], r"robot\.axes\[5\] = \[0\.0, 0\.0, 0\.0\]: .* other than zero"),
        ([*["yaw"] * 5, (0, 1)], r"robot\.axes\[5\] = \[0\.0, 1\.0\]: expected .* one vector \(x, y, z\)"),
        (
            [*["yaw"] * 5, "sideways"],
            r"robot\.axes\[5\] = \"sideways\": expected \"both\", \"yaw\", \"pitch\", \"roll\"",
        ),
        ("sideways", r"robot\.axes = \"sideways\""),
        (3, r"robot\.axes = 3"),
    ],
)
def test_faulty_axes_are_named(axes, message):
    with pytest.raises(ConfigError, match=message):
        Robot(links=7, axes=axes)


def test_models_refuse_axes_that_they_do_not_have():
    robot = Robot(links=7, axes=ALTERNATING)
    for model in ("planar", "minimal"):
        with pytest.raises(ConfigError, match=r"robot\.axes\[1\] = \"pitch\": .*model=\"spatial\""):
            simulate(model=model, robot=robot, duration=0.1)
    with pytest.raises(ConfigError, match=r"robot\.axes\[0\] = \"yaw\": .*method=\"implicit\""):
        simulate(model="spatial", robot=robot, duration=0.1, integrator=Integrator(method="thesis"))


@pytest.mark.parametrize(("mode", "actions"), [("gait", 6), ("joints", 7), ("residual", 13), ("torques", 7)])
def test_environments_have_an_action_and_observations_for_each_axis(mode, actions):
    names = ["yaw_1", "roll_2", "yaw_3", "pitch_3", "pitch_4", "axis_5", "yaw_6"]
    envs = gym.make_vec("SnakeSpatial-v1", num_envs=2, robot=Robot(links=7, axes=MIXED), action_mode=mode)
    core = envs.unwrapped
    blocks = {block["name"]: block["elements"] for block in core.layout["observation"]}
    assert blocks["joint_angle"] == blocks["joint_rate"] == names
    assert envs.single_action_space.shape == (actions,)
    envs.reset(seed=0)
    for _ in range(4):
        observation, *_ = envs.step(envs.action_space.sample())
    state = core.state()
    assert state.joint_angle.shape == state.joint_rate.shape == state.joint_torque.shape == (2, 7)
    start = next(block for block in core.layout["observation"] if block["name"] == "joint_angle")
    seen = observation[:, start["start"] : start["start"] + 7] * start["scale"]
    np.testing.assert_allclose(seen, state.joint_angle, atol=1e-6)
    envs.close()


OFFSETS = [0.05, -0.03, 0.0, 0.02, -0.05, 0.04, -0.02]


@pytest.mark.parametrize(
    ("axes", "fields"),
    [
        (ALTERNATING, {}),
        (MIXED, {}),
        (MIXED, {"locked": (2,), "limp": (5,)}),
        (ALTERNATING, {"cg_offset": np.multiply(0.4, OFFSETS)}),
        (MIXED, {"cg_offset": OFFSETS}),
    ],
)
def test_chains_of_hinges_fly_as_in_mujoco(axes, fields):
    robot = Robot(links=7, axes=axes, gravity=1e-9, joint_limit=np.inf, self_contact=False, **fields)
    count = len(robot.joint_axes)
    bent = 0.4 * np.sin(1.7 * np.arange(count))
    start = Start(position=(0.0, 0.0, 5.0), heading=0.7, roll=0.3, pitch=0.2, posture=bent)
    springs, rest = PD(kp=2.0, kd=0.0), JointTrajectory([0.0, 9.0], np.zeros((2, count)))
    run = simulate(
        model="spatial",
        robot=robot,
        start=start,
        gait=rest,
        controller=springs,
        duration=0.6,
        sample=0.6,
        integrator=Integrator(step=1e-3),
    )
    assert np.abs(run.joint_angle[1] - run.joint_angle[0]).max() > 0.2
    reached = []
    for step in (1e-3, 2.5e-4):
        model, data = in_mujoco(Scene(), robot=robot, controller=springs, start=start, step=step)
        np.testing.assert_allclose(data.qpos[7:], bent, atol=1e-12)
        data.ctrl[:] = 0.0
        advance(model, data, 0.6)
        positions = np.array([data.body(f"link_{i}").xipos for i in range(1, 8)])
        reached.append(np.concatenate([positions.ravel(), data.qpos[7:]]))
    # MuJoCo's scheme is of first order.
    limit = reached[1] + (reached[1] - reached[0]) / 3.0
    own = np.concatenate([run.position[1].ravel(), run.joint_angle[1]])
    assert np.abs(reached[0] - own).max() > 5e-3
    assert np.abs(limit - own).max() < 1e-4


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_joints_have_limits_of_their_own(model):
    in_3d = [(-0.2, 0.4), 0.3, (0.0, 3.0), np.inf, 1.0, (-3.0, 0.1)]
    limits = in_3d if model == "spatial" else [(-0.2, 0.4), 0.3, (0.0, np.inf), np.inf, 1.0, (-np.inf, 0.1)]
    robot = Robot(links=7, joint_limit=limits, self_contact=False, axes="yaw")
    assert Robot.of(dataclasses.asdict(robot)) == robot
    free = Scene(friction=(0.0, 0.0), rolling_friction=0.0) if model == "spatial" else Scene(friction=(0.0, 0.0))
    for wanted, reached in ((0.6, [0.4, 0.3, 0.6, 0.6, 0.6, 0.1]), (-0.6, [-0.2, -0.3, 0.0, -0.6, -0.6, -0.6])):
        bend = JointTrajectory([0.0, 1.0], [[0.0] * 6, [wanted] * 6])
        run = simulate(model=model, robot=robot, gait=bend, scene=free, controller=PD(20.0, 1.0), duration=4.0)
        np.testing.assert_allclose(run.joint_angle[-1], reached, atol=2e-3)
    robot = dataclasses.replace(robot, joint_limit=in_3d)
    with pytest.raises(ConfigError, match=r"start\.posture\[0\] = 0\.6: expected an angle in \[-0\.2, 0\.4\]"):
        simulate(model="spatial", robot=robot, start=Start(posture=[0.6, 0, 0, 0, 0, 0]), duration=0.1)
    model, _ = in_mujoco(Scene(), robot=robot, start=Start(posture="straight"))
    np.testing.assert_array_equal(model.jnt_limited[1:], [1, 1, 1, 0, 1, 1])
    np.testing.assert_allclose(model.jnt_range[[1, 2, 5]], [[-0.2, 0.4], [-0.3, 0.3], [-1.0, 1.0]])


@pytest.mark.parametrize("wrong", [(0.5, -0.5), (0.2, 0.4), -1.0, (0.0, 0.0), (1.0,), float("nan")])
def test_limits_that_cross_are_named(wrong):
    with pytest.raises(ConfigError, match=r"robot\.joint_limit"):
        Robot(links=3, joint_limit=[1.0, wrong])
    with pytest.raises(ConfigError, match=r"robot\.joint_limit = 2 entries: .*a list of 3 entries"):
        Robot(links=4, joint_limit=[1.0, 1.0])


@pytest.mark.parametrize("limit", [4.0, [1.0, (-0.1, 4.0)], [1.0, (0.0, float("inf"))]])
def test_limits_that_angles_in_3d_would_jump_over_are_refused(limit):
    robot = Robot(links=3, joint_limit=limit)
    simulate(robot=robot, duration=0.1)
    with pytest.raises(ConfigError, match=r"robot\.joint_limit.* = \[-?\S+, \S+\]: expected within \[-3\.13, 3\.13\]"):
        simulate(model="spatial", robot=robot, duration=0.1)


def test_axes_survive_the_way_through_a_mapping():
    robot = Robot(links=7, axes=MIXED)
    assert Robot.of(dataclasses.asdict(robot)) == robot


def test_references_of_their_own_that_come_late_are_those_of_each_axis():
    wanted = 0.1 * np.arange(1.0, 7.0)
    gait = JointTrajectory([0.0, 1.0], [wanted, wanted])
    free = {"start": Start(posture=wanted, position=(0.0, 0.0, 9.0)), "scene": Scene(friction=(0.0, 0.0))}
    late = run(ALTERNATING, gait=gait, reference_delay=0.05, **free)
    np.testing.assert_allclose(late.joint_angle, np.tile(wanted, (3, 1)), atol=1e-3)


def test_absent_axes_have_no_angle_at_the_start():
    # The wave would bend the yaw of joint 3, which it does not have, by -0.35 rad.
    limits = [1.5, 1.5, 1.5, (-0.3, 1.2), 1.5, 1.5]
    robot = Robot(links=7, axes=ALTERNATING, joint_limit=limits)
    simulate(model="spatial", robot=robot, gait=Gait.lateral_undulation(), duration=0.1)
    # All pitches of the lifting wave are absent: the robot lies flat.
    flat = simulate(model="spatial", robot=Robot(links=7, axes="yaw"), gait=Gait.lateral_rolling(), duration=0.1)
    np.testing.assert_allclose(flat.position[0, :, 2], flat.position[0, 0, 2], atol=1e-9)


@pytest.mark.parametrize("axes", [ALTERNATING, ["both"] * 3 + ["pitch", (-1.0, 0.1, 0.0), "roll"]])
def test_angles_about_absent_axes_are_refused_by_joint(axes):
    robot, pairs = Robot(links=7, axes=axes), np.zeros((6, 2))
    pairs[3] = (0.0, 0.1)
    simulate(model="spatial", robot=robot, start=Start(posture=pairs), duration=0.1)
    pairs[3] = (0.2, 0.1)
    message = r"start\.posture\[3\] = \[0\.2, 0\.1\]: expected \(0, pitch\), of the axis that the joint has"
    with pytest.raises(ConfigError, match=message):
        simulate(model="spatial", robot=robot, start=Start(posture=pairs), duration=0.1)
    with pytest.raises(ConfigError, match=message):
        gym.make("SnakeSpatial-v1", robot=robot, start=Start(posture=pairs))


def test_vectors_along_the_axes_of_a_link_have_their_names():
    robot = Robot(links=4, axes=[(0.0, 2.0, 0.0), (3.0, 0.0, 0.0), (0.0, 0.0, 0.5)])
    assert robot.joint_axes == [(0, "yaw"), (1, "pitch"), (2, "roll")]


def test_states_of_a_robot_with_other_axes_are_refused():
    def make(axes):
        return gym.make_vec("SnakeSpatial-v1", num_envs=1, robot=Robot(axes=axes)).unwrapped

    cardan, hinges = make(["both"] * 10), make(["yaw", "pitch"] * 5)
    cardan.reset(seed=0)
    hinges.reset(seed=0)
    with pytest.raises(ConfigError, match="state"):
        hinges.set_state(cardan.get_state())


def bend(robot, amplitude=0.4, **options):
    """An arc to either side in turn, all yaw joints alike: half of the robot is the mirror image of the other half.
    Returns the motion of the CG along and across it in each period [mm], and the run."""
    gait, period = Gait(amplitude=amplitude, omega=1.0, beta=0.0), 2.0 * np.pi
    options |= {"gait": gait, "duration": 2.0 * period, "sample": period / 40.0, "record": "ground"}
    found = simulate("spatial", robot, Scene(friction=(0.2, 0.6)), start=Start(posture="straight"), **options)
    return 1e3 * np.diff(found.position[::40].mean(axis=1), axis=0)[:, :2], found


def test_cardan_joints_have_no_symmetry_fore_and_aft():
    """A joint transmits torsion along the link behind it, so links on flat ground that roll by small angles roll by
    cos(yaw) times the link before. Friction acts a radius below the joints and rolls them: loads become unequal."""
    drift, run = bend(Robot(links=3))
    mirrored, softer = (bend(Robot(links=3), a, controller=PD(kp=kp))[0] for a, kp in ((-0.4, 800.0), (0.4, 200.0)))
    lower, _ = bend(Robot(links=3, radius=Robot().radius / 10.0))
    load = run.ground_normal[40:].sum(axis=2)
    unequal = (load[:, 0] - load[:, 2]) / load.mean()
    print(
        f"{drift[1]} mm, with small radii {lower[1]} mm; loads {100 * unequal.min():.1f} to {100 * unequal.max():.1f} %"
    )
    # Statics: the default step is too long for the bound.
    fine = bend(Robot(links=3), integrator=Integrator(step=0.005))[1]
    coarse, error = (
        of.joint_torque[50, 1, 1] / of.joint_torque[50, 0, 1] - np.cos(of.joint_angle[50, 0, 0]) for of in (run, fine)
    )
    print(f"ratio of pitch torques off by {coarse:.1e}, in steps of 5 ms by {error:.1e}")
    assert abs(error) < 3e-4
    # Statics with least dissipation and the shortest impulses give 6.7 mm. With all joints reversed both change sign.
    assert drift[1, 0] == pytest.approx(6.6, abs=0.2)
    np.testing.assert_allclose([mirrored[1, 0], softer[1, 0]], drift[1, 0], atol=0.15)
    assert lower[1, 0] == pytest.approx(0.8, abs=0.05)


def test_a_robot_that_is_symmetric_fore_and_aft_does_not_drift():
    drift, run = bend(Robot(links=5, axes=["pitch", "yaw", "yaw", "pitch"]))
    load = run.ground_normal[1:]
    assert np.abs(drift).max() < 5e-3
    np.testing.assert_allclose(load, load[:, ::-1, ::-1], atol=1e-4)


def test_a_robot_without_pitch_rocks_when_it_has_been_straight():
    """Nothing keeps a straight robot from rolling, and bent it stands on three or four spheres."""
    run, mirrored = (bend(Robot(links=3, axes="yaw"), amplitude)[1] for amplitude in (0.38, -0.38))
    lifted = [1e3 * (of.position[:, :, 2].max() - of.robot.radius) for of in (run, mirrored)]
    print(f"a CG {lifted[0]:.1f} mm higher")
    np.testing.assert_allclose(lifted, 1.0, atol=0.3)
    # At half the period it is straight again, and errors of the solver decide how it rolls on.
    np.testing.assert_allclose(mirrored.position[:20], run.position[:20] * [1.0, -1.0, 1.0], atol=1e-8)
