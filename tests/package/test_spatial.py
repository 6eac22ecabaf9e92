"""Scripted runs of the spatial model."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import check_arrays

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, JointTrajectory, Robot, Scene, Start

THESIS = Integrator(method="thesis")
RADIUS = 0.0525


def run(**keywords):
    return snake_env.simulate(model="spatial", **({"integrator": THESIS} | keywords))


def axes(quaternion):
    """e_x^B, e_y^B and e_z^B of unit quaternions, w first."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    e_x = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], -1)
    e_y = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], -1)
    e_z = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], -1)
    return e_x, e_y, e_z


def test_arrays_have_the_promised_shapes_and_layout():
    links, rows = 7, 4
    trajectory = run(robot=Robot(links=links), duration=0.3, sample=0.1)
    joints, forces = (links - 1, 2), (links, 3)
    check_arrays(
        trajectory,
        position=forces,
        angle=(links,),
        quaternion=(links, 4),
        joint_angle=joints,
        joint_torque=joints,
        contact_force=forces,
    )
    assert len(trajectory.time) == rows
    np.testing.assert_allclose(np.linalg.norm(trajectory.quaternion, axis=-1), 1.0, atol=1e-15)
    assert trajectory.max_joint_gap < 1e-14
    assert trajectory.passive_velocity is None


def test_joints_join_the_links_and_turn_as_said():
    trajectory = run(gait=Gait.sidewinding(), duration=0.2, start=Start(posture="straight"))
    e_x, e_y, e_z = axes(trajectory.quaternion)
    front, rear = trajectory.position + 0.061 * e_z, trajectory.position - 0.061 * e_z
    np.testing.assert_allclose(front[:, :-1], rear[:, 1:], atol=1e-14)
    np.testing.assert_allclose(np.arctan2(e_z[..., 1], e_z[..., 0]), trajectory.angle, atol=1e-14)
    # The next link's centre line in this link's axes: (sin yaw cos pitch, -sin pitch, cos yaw cos pitch).
    yaw, pitch = trajectory.joint_angle[..., 0], trajectory.joint_angle[..., 1]
    along = np.stack([np.sum(e[:, :-1] * e_z[:, 1:], -1) for e in (e_x, e_y, e_z)], -1)
    expected = np.stack([np.sin(yaw) * np.cos(pitch), -np.sin(pitch), np.cos(yaw) * np.cos(pitch)], -1)
    np.testing.assert_allclose(along, expected, atol=1e-12)
    assert np.abs(pitch).max() > 0.05


def test_row_zero_is_the_start():
    start = Start(position=(0.3, -0.2, 0.4), heading=1.0, pitch=0.5, posture=[(0.1, -0.2)] * 10)
    trajectory = run(start=start, duration=0.01, sample=0.01)
    np.testing.assert_array_equal(trajectory.position[0, 0], [0.3, -0.2, 0.4])
    np.testing.assert_allclose(trajectory.joint_angle[0], np.tile([0.1, -0.2], (10, 1)), atol=1e-14)
    _, _, e_z = axes(trajectory.quaternion[0, 0])
    along = [np.cos(1.0) * np.cos(0.5), np.sin(1.0) * np.cos(0.5), np.sin(0.5)]
    np.testing.assert_allclose(e_z, along, atol=1e-15)
    weight = 7.5 / 11 * 9.81
    np.testing.assert_allclose(trajectory.energy[0], weight * trajectory.position[0, :, 2].sum(), rtol=1e-12)


def test_a_joint_that_pitches_by_as_much_as_the_start_levels_the_link_behind_it():
    start = Start(position=(0.0, 0.0, 0.4), pitch=0.5, posture=[(0.0, 0.5), *[(0.0, 0.0)] * 9])
    height = run(start=start, duration=0.01, sample=0.01).position[0, :, 2]
    np.testing.assert_allclose(height[1:], height[1], atol=1e-14)
    assert height[1] > height[0]


QUARTER = np.pi / 2


@pytest.mark.parametrize(("limit", "largest"), [(None, QUARTER), (0.5, QUARTER), (2.5, 2.5), (np.inf, np.pi)])
def test_references_and_postures_go_as_far_as_the_joint_limit(limit, largest):
    robot = Robot(links=3, joint_limit=limit, self_contact=False)

    def accepts(gait=None, posture="straight", **keywords):
        start = Start(position=(0.0, 0.0, 1.0), posture=posture)
        keywords = {"robot": robot, "gait": gait, "start": start, "duration": 0.01, "sample": 0.01} | keywords
        snake_env.simulate(model="spatial", **keywords)

    for sign in (1.0, -1.0):
        accepts(Gait(amplitude=0.0, gamma=sign * largest))
        accepts(Gait(amplitude=sign * (largest - 0.3), gamma=0.1 + 0.2))
        accepts(Gait(amplitude=0.0, vertical_amplitude=sign * largest))
        accepts(JointTrajectory([0.0, 1.0], np.full((2, 2, 2), sign * largest)))
        accepts(posture=np.full((2, 2), sign * largest))
        beyond = sign * (largest + 0.03)
        for refused in (
            {"gait": Gait(amplitude=0.0, gamma=beyond)},
            {"gait": Gait(amplitude=0.0, vertical_amplitude=beyond)},
            {"gait": JointTrajectory([0.0, 1.0], np.full((2, 2), beyond))},
            {"posture": np.full(2, beyond)},
        ):
            with pytest.raises(ConfigError):
                accepts(**refused)
    with pytest.raises(ConfigError, match=r"gait\.gamma"):
        accepts(Gait(amplitude=0.0, gamma=1.6), robot=Robot(links=3, self_contact=False), integrator=THESIS)


def test_joints_bend_beyond_a_right_angle_where_their_limit_lets_them():
    bent = JointTrajectory([0.0, 0.5], [np.zeros((2, 2)), [[2.0, 0.0], [0.0, -2.2]]])
    robot = Robot(links=3, joint_limit=2.5, self_contact=False)
    start = Start(position=(0.0, 0.0, 1.0), posture="straight")
    still = snake_env.simulate("spatial", robot=robot, gait=bent, start=start, duration=0.6, sample=0.1)
    np.testing.assert_allclose(still.joint_angle[-1], [[2.0, 0.0], [0.0, -2.2]], atol=0.02)
    env = snake_env.SnakeEnv(model="spatial", task="free", robot=robot, start=Start(posture=still.joint_angle[-1]))
    env.reset(seed=0)
    np.testing.assert_allclose(env.state().joint_angle, still.joint_angle[-1], atol=1e-12)


@pytest.mark.parametrize("limit", [None, np.inf])
@pytest.mark.parametrize("integrator", [Integrator(), THESIS])
def test_a_posture_that_a_run_returned_is_a_start(limit, integrator):
    """Of a limp robot that falls into a heap, on its stops where it has some."""
    if limit is not None and integrator is THESIS:
        pytest.skip("the printed scheme has no limits")
    robot = Robot(links=6, joint_limit=limit, self_contact=False)
    limp, thrown = PD(kp=0.0, kd=0.0), [(1.2 * (-1) ** joint, QUARTER) for joint in range(5)]
    keywords = {"model": "spatial", "robot": robot, "controller": limp, "integrator": integrator}
    heap = snake_env.simulate(start=Start(position=(0.0, 0.0, 0.7), posture=thrown), duration=0.8, **keywords)
    assert np.abs(heap.joint_angle).max() > QUARTER
    for angles in heap.joint_angle:
        again = snake_env.simulate(start=Start(posture=angles), duration=0.01, sample=0.01, **keywords)
        np.testing.assert_allclose(again.joint_angle[0], angles, atol=1e-12)


def test_without_a_height_the_robot_rests_on_the_ground():
    flat = run(start=Start(posture="straight"), duration=0.01, sample=0.01)
    np.testing.assert_allclose(flat.position[0, :, 2], RADIUS, atol=1e-15)
    lifted = run(start=Start(posture="straight", pitch=0.3), duration=0.01, sample=0.01)
    ends = lifted.position[0, 0, 2] - 0.0393 * np.sin(0.3)
    np.testing.assert_allclose(ends, RADIUS, atol=1e-15)
    yaws = run(start=Start(posture=[0.2] * 10), duration=0.01, sample=0.01)
    np.testing.assert_allclose(yaws.joint_angle[0, :, 0], 0.2, atol=1e-14)


def test_a_start_pitches_the_robot_head_down_and_rolls_its_left_side_down():
    e_x, _, e_z = axes(run(start=Start(posture="straight", pitch=0.2, roll=0.3), duration=0.01, sample=0.01).quaternion)
    np.testing.assert_allclose(-e_z[0, :, 2], -np.sin(0.2), atol=1e-14)
    np.testing.assert_allclose(-e_x[0, :, 2], -np.cos(0.2) * np.sin(0.3), atol=1e-14)


def test_u_shaped_rolling_starts_on_its_side_and_rolls_sideways_towards_the_edge_of_the_u():
    trajectory = run(gait=Gait.lateral_rolling(), duration=4.5, sample=0.5)
    np.testing.assert_allclose(trajectory.position[0, :, 2], RADIUS, atol=1e-12)
    np.testing.assert_allclose(trajectory.joint_angle[0, :, 1], np.radians(10), atol=1e-12)
    centre = trajectory.position.mean(axis=1)[:, :2]
    chord = trajectory.position[0, -1, :2] - trajectory.position[0, 0, :2]
    edge = trajectory.position[0, 5, :2] - 0.5 * (trajectory.position[0, 0, :2] + trajectory.position[0, -1, :2])
    moved = centre[-1] - centre[0]
    assert moved @ edge > 0.99 * np.linalg.norm(moved) * np.linalg.norm(edge)
    assert abs(moved @ chord) < 0.05 * np.linalg.norm(moved) * np.linalg.norm(chord)
    assert 0.06 < np.linalg.norm(moved) / 4.5 < 0.08


def test_pegs_push_horizontally_and_drive_the_robot_forward():
    trajectory = run(scene=Scene.preset("table-7.5"), duration=4.0, sample=0.5)
    assert np.all(trajectory.contact_force[..., 2] == 0.0)
    assert trajectory.contact_force[2:, :, 0].sum(axis=1).mean() > 5.0
    speed = (trajectory.position[-1, 5, 0] - trajectory.position[2, 5, 0]) / 3.0
    assert 0.14 < speed < 0.19
    assert trajectory.max_penetration < 1e-4


def test_the_drop_of_section_7_3_1_ends_at_rest_with_actuators_off():
    trajectory = run(
        scene=Scene(friction=(0.2, 0.5)),
        gait=Gait.lateral_undulation(soft_start=True),
        controller=PD(active_from=1.0),
        integrator=Integrator(method="thesis", r_n=0.01),
        start=Start(position=(0.0, 0.0, 0.3525), pitch=np.radians(30), posture="straight"),
        duration=1.0,
        sample=0.05,
    )
    assert not trajectory.joint_torque.any()
    assert np.all(np.diff(trajectory.energy) < 0.05), "inelastic: no energy comes from nothing"
    np.testing.assert_allclose(trajectory.position[-1, :, 2], RADIUS, atol=1e-3)
    assert trajectory.max_penetration < 1e-3


def test_rolling_friction_acts_in_space_alone():
    without, much = Scene(rolling_friction=0.0), Scene(rolling_friction=0.05)
    planar = [snake_env.simulate(scene=scene, duration=0.1) for scene in (without, much)]
    np.testing.assert_array_equal(planar[0].position, planar[1].position)
    rolling = [run(scene=scene, gait=Gait.lateral_rolling(), duration=0.5, sample=0.5) for scene in (without, much)]
    assert np.abs(rolling[0].position - rolling[1].position).max() > 1e-7


def test_references_are_the_waves_of_the_thesis():
    time = np.linspace(0.0, 5.0, 7)
    gait, phase = Gait.sidewinding(), np.radians(80 * time[:, None] - 50 * np.arange(10))
    np.testing.assert_allclose(gait.reference(time)["angle"], np.radians(30) * np.sin(phase), atol=1e-14)
    vertical = np.radians(10) * np.sin(phase + np.pi / 2)
    np.testing.assert_allclose(gait.reference(time, vertical=True)["angle"], vertical, atol=1e-14)


def test_a_run_takes_the_documented_default_step():
    """25 ms at most, however an interval between samples is divided."""
    scene = Scene.preset("table-7.5")
    default, documented, other = (
        run(scene=scene, integrator=Integrator(step=step), duration=0.5, sample=0.1) for step in (None, 0.025, 0.005)
    )
    np.testing.assert_array_equal(default.position, documented.position)
    assert not np.array_equal(default.position, other.position)


POSES = {
    "upside down": Start(roll=np.pi),
    "on its side": Start(roll=np.pi / 2),
    "upright": Start(pitch=np.pi / 2, posture="straight"),
    "on its head": Start(pitch=-np.pi / 2, posture="straight"),
    "thrown": Start(position=(0.0, 0.0, 1.0), pitch=1.0, roll=0.7, posture="straight"),
    "upright among pegs": Start(position=(1.0247, 0.1416), pitch=np.pi / 2, posture="straight"),
}


@pytest.mark.filterwarnings("ignore:a link penetrated an obstacle or the ground")
@pytest.mark.parametrize("integrator", [THESIS, None], ids=["thesis", "default"])
@pytest.mark.parametrize("pose", POSES)
def test_a_robot_in_any_pose_stays_above_the_ground_and_outside_of_pegs(pose, integrator):
    """The thesis's contacts act on velocity level: at 5 m/s half a step of 2.5e-4 s is 0.6 mm, whips are faster."""
    scene = Scene.preset("table-7.5" if "pegs" in pose else "free")
    gait = Gait.lateral_undulation(soft_start=POSES[pose].posture == "straight")
    trajectory = run(scene=scene, start=POSES[pose], gait=gait, integrator=integrator, duration=2.0, sample=0.5)
    assert np.isfinite(trajectory.position).all()
    assert trajectory.unconverged.sum() == 0
    assert trajectory.max_penetration < (2e-3 if integrator else 1e-4)


def forward_speed(gait, friction):
    """Of the gravity centre over the second period, along the way from link 11 to link 1 [m/s]."""
    trajectory = run(gait=gait, scene=Scene(friction=friction), integrator=None, duration=9.0, sample=4.5)
    first, second = trajectory.position[1:].mean(axis=1)
    ahead = trajectory.position[-1, 0] - trajectory.position[-1, -1]
    return float((second - first) @ ahead / np.linalg.norm(ahead)) / 4.5


@pytest.mark.parametrize("friction", [(0.2, 0.5), (0.02, 1.0)])
def test_sinus_lifting_is_faster_than_lateral_undulation(friction):
    plain, lifting = (forward_speed(gait, friction) for gait in (Gait(), Gait.sinus_lifting()))
    assert lifting > 1.05 * plain > 0.0


def test_the_caterpillar_stays_upright_and_follows_its_wave():
    """Until round-off tips it over: upright is unstable, as a joint shows that is bent sideways by a microradian."""
    gait = Gait.caterpillar(soft_start=True)
    trajectory = run(gait=gait, integrator=None, start=Start(posture="straight"), duration=6.0, sample=0.5)
    _, e_y, _ = axes(trajectory.quaternion)
    assert e_y[..., 2].min() > 0.8
    way = trajectory.position[-1].mean(axis=0) - trajectory.position[-10].mean(axis=0)
    assert way[0] < -0.05, "the wave runs from link 1 to link 11, that is to -x"
    assert abs(way[1]) < 1e-3
    bent = np.zeros((10, 2))
    bent[0, 0] = 1e-6
    tipped = run(gait=gait, integrator=None, start=Start(posture=bent), duration=9.0, sample=0.5)
    assert axes(tipped.quaternion)[1][-1, :, 2].max() < 0.5


def test_lying_flat_among_pegs_the_spatial_model_is_the_planar_one():
    """Friction acts at both ends of a link instead of its middle, which pegs hardly let show (section 7.3.4)."""
    scene = Scene.preset("table-7.5")
    planar = snake_env.simulate(scene=scene, duration=9.0, sample=4.5)
    spatial = run(scene=scene, integrator=None, duration=9.0, sample=4.5)
    ways = [(trajectory.position[2] - trajectory.position[1])[:, 0] for trajectory in (planar, spatial)]
    np.testing.assert_allclose(ways[0], ways[1], rtol=5e-3)
    np.testing.assert_allclose(spatial.position[..., 2], RADIUS, atol=1e-5)
    np.testing.assert_allclose(planar.position[2], spatial.position[2, :, :2], atol=5e-3)


HEAVY = 1e3
"""Mass of the leading link over that of the other."""


@pytest.mark.parametrize(
    ("robot", "scene", "controller", "start", "duration", "row", "after"),
    [
        pytest.param(
            Robot(links=2, mass=[HEAVY, 1.0], inertia=[HEAVY * 2e-3, 2e-3], roll_inertia=[HEAVY * 1e-3, 1e-3]),
            Scene(friction=(0.0, 0.0), rolling_friction=0.0),
            PD(kp=0.01, kd=0.0, active_from=0.5),
            Start(posture=[0.5]),
            2.0,
            lambda way: way.joint_angle[:, 0, 0],
            lambda angle: angle < 0.45,
            id="a weak joint behind a heavy link",
        ),
        pytest.param(
            Robot(links=2, gravity=5e-5),
            Scene(),
            PD(),
            Start(position=(0.0, 0.0, 1.0), posture="straight"),
            100.0,
            lambda way: way.position[:, 0, 2],
            lambda height: height == pytest.approx(1.0 - 0.5 * 5e-5 * 100.0**2, abs=1e-3),
            id="a robot in the air under hardly any gravity",
        ),
        pytest.param(
            Robot(links=2),
            Scene(friction=(1.0, 1.0), rolling_friction=0.0),
            PD(),
            Start(posture="straight", pitch=-(np.pi / 2 - 1e-5)),
            4.0,
            lambda way: way.position[:, 0, 2],
            lambda height: height < 0.1,
            id="an upright chain all but in balance",
        ),
    ],
)
def test_what_is_pushed_ever_so_little_sets_out(robot, scene, controller, start, duration, row, after):
    """A robot that stands is not held against more than friction holds it."""
    way = snake_env.simulate(
        model="spatial", robot=robot, scene=scene, controller=controller, start=start, duration=duration,
        gait=Gait(amplitude=0.0), sample=duration,
    )  # fmt: skip
    assert after(row(way)[-1]), row(way)
