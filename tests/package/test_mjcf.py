"""Robot and scene as a model of MuJoCo, against this package's own."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from conftest import advance, in_mujoco

from snake_env import (
    PD,
    ConfigError,
    Gait,
    Integrator,
    JointTrajectory,
    Robot,
    Scene,
    SnakeEnv,
    Start,
    Stribeck,
    simulate,
)
from snake_env.obstacles import Box, Cylinder, HeightField, Polygon, Polyhedron, Segment, Sphere

mujoco = pytest.importorskip("mujoco")

FIELD = HeightField(height=[[0.0, 0.1], [0.1, 0.2]], spacing=1.0, origin=(2.0, 2.0))


def links(model, data):
    """CGs of the links (n, 3)."""
    return np.array([data.body(f"link_{i}").xipos for i in range(1, model.nbody)])


def test_the_robot_lies_where_the_environment_puts_it():
    start = Start(position=(0.3, -0.2), heading=2.5)
    env = SnakeEnv(model="spatial", task="course", start=start, start_jitter=0.0)
    env.reset(seed=0)
    model, data = in_mujoco(Scene.preset("table-7.5"), start=start)
    np.testing.assert_allclose(links(model, data), env.state().link_position, atol=1e-9)
    assert model.body_mass.sum() == pytest.approx(7.5)


@pytest.mark.parametrize(
    ("start", "gait"),
    [
        (Start(position=(0.3, -0.2), heading=1.0, pitch=0.3), Gait.sidewinding()),
        (Start(position=(0.0, 0.0, 0.3), heading=1.0, roll=0.4), Gait.lateral_undulation()),
        (Start(posture=[(0.1 * i, -0.05 * i) for i in range(10)]), Gait.lateral_undulation()),
        (Start(), Gait.lateral_rolling()),
    ],
)
def test_the_robot_lies_where_simulate_puts_it(start, gait):
    run = simulate(model="spatial", start=start, gait=gait, duration=1e-3, sample=1e-3)
    np.testing.assert_allclose(links(*in_mujoco(Scene(), start=start, gait=gait)), run.position[0], atol=1e-12)


def test_per_link_quantities_reach_their_links():
    robot = Robot(links=3, length=(0.1, 0.2, 0.3), mass=(1.0, 2.0, 3.0), inertia=(1e-3, 2e-3, 3e-3), joint_limit=1.2)
    model, data = in_mujoco(Scene(), robot=robot, start=Start(posture="straight"))
    np.testing.assert_allclose(links(model, data)[:, 0], [0.0, -0.15, -0.4], atol=1e-12)
    np.testing.assert_allclose(model.body_mass[1:], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(model.body_inertia[1:, 1], [1e-3, 2e-3, 3e-3])
    np.testing.assert_allclose(model.jnt_range[1:], [[-1.2, 1.2]] * 4)


@pytest.mark.parametrize(("limit", "is_limited"), [(None, True), (np.inf, False)])
def test_joints_have_the_limits_of_the_spatial_model(limit, is_limited):
    model, _ = in_mujoco(Scene(), robot=Robot(joint_limit=limit), start=Start(posture="straight"))
    assert (model.jnt_limited[1:] == is_limited).all()
    if is_limited:
        np.testing.assert_allclose(model.jnt_range[1:], [[-np.pi / 2, np.pi / 2]] * 20)


def servo_targets(gait, controller):
    """Of the ten cardan joints [rad] as a function of time; ahead of the angles, as the damping of the servos holds
    back."""

    def targets(time):
        both = [gait.reference(np.array([time]), 10, vertical) for vertical in (False, True)]
        angle, rate = (np.stack([wave[name][0] for wave in both], axis=-1).ravel() for name in ("angle", "rate"))
        return angle + controller.kd / controller.kp * rate

    return targets


def slope(friction, share, heading):
    """A scene without rolling friction, inclined at ``share`` of the slope at which a link of this heading slides."""
    critical = 1.0 / np.hypot(np.cos(heading) / friction[0], np.sin(heading) / friction[1])
    return Scene(friction=friction, slope=(np.arctan(share * critical), 0.0), rolling_friction=0.0)


@pytest.mark.parametrize(("share", "creep"), [(0.5, 1e-6), (0.95, 4e-6)])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"start": Start(heading=1.0)},
        {"robot": Robot(links=20), "start": Start(heading=0.0, posture="straight")},
        {"step": 0.004, "start": Start(heading=0.0, posture="straight")},
    ],
)
def test_a_robot_that_friction_holds_hardly_creeps(options, share, creep):
    """MuJoCo's friction is damping below its bound, so that some creep is left [m/s]."""
    model, data = in_mujoco(slope((0.3, 0.3), share, 0.0), **options)
    advance(model, data, 2.0)
    before = links(model, data)
    advance(model, data, 1.0)
    assert np.abs(links(model, data) - before)[:, :2].max() < creep


@pytest.mark.parametrize("heading", [0.0, 0.25 * np.pi, 0.5 * np.pi, 2.5])
def test_friction_along_and_across_turns_with_the_links(heading):
    """A robot too sluggish to roll slides where the ellipse of the friction ends, whatever its direction."""
    robot, start = Robot(links=2, inertia=1e3, roll_inertia=1e3), Start(heading=heading, posture="straight")
    for share in (0.98, 1.02):
        model, data = in_mujoco(slope((0.2, 0.5), share, heading), robot=robot, start=start)
        advance(model, data, 0.5)
        before = links(model, data)
        advance(model, data, 1.0)
        assert (np.hypot(*(links(model, data) - before)[0, :2]) > 1e-3) == (share > 1.0)


@pytest.mark.parametrize("friction", [(0.2, 0.2), (0.1, 0.7)])
def test_sidewinding_covers_the_same_ground_in_both(friction):
    """Two programs, two kinds of contacts: their distances agree within a few percent."""
    scene, controller = Scene(friction=friction, rolling_friction=0.0), PD(torque_limit=20.0)
    gait = Gait.sidewinding()
    run = simulate(model="spatial", scene=scene, gait=gait, controller=controller, duration=6.0, sample=1.0)
    model, data = in_mujoco(scene, controller=controller, gait=gait, step=0.001)
    before = links(model, data).mean(axis=0)
    advance(model, data, 6.0, servo_targets(gait, controller))
    theirs = (links(model, data).mean(axis=0) - before)[:2]
    ours = (run.position[-1].mean(axis=0) - run.position[0].mean(axis=0))[:2]
    assert np.hypot(*ours) > 0.2
    assert np.hypot(*(theirs - ours)) < 0.03 * np.hypot(*ours)


@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
def test_locked_joints_hold_and_limp_ones_have_no_actuator(step):
    """The robot falls onto the ground; springs of 1e9 N m/rad give way by 1e-9 rad per N m."""
    start = Start(position=(0.0, 0.0, 0.2), roll=0.4)
    model, data = in_mujoco(Scene(), robot=Robot(locked=(3,), limp=(6,)), start=start, step=step)
    absent = {"yaw_4", "pitch_4", "yaw_7", "pitch_7"}
    assert {model.actuator(i).name for i in range(model.nu)} == {model.joint(j).name for j in range(1, 21)} - absent
    given = data.qpos.copy()
    np.testing.assert_array_equal(data.ctrl, [given[model.joint(model.actuator(i).name).qposadr[0]] for i in range(16)])
    held, free = ([model.joint(f"{axis}_{j}").qposadr[0] for axis in ("yaw", "pitch")] for j in (4, 7))
    moved = 0.0
    for _ in range(round(0.5 / step)):
        mujoco.mj_step(model, data)
        np.testing.assert_allclose(data.qpos[held], given[held], atol=1e-7)
        moved = max(moved, np.abs(data.qpos - given)[free].max())
    assert moved > 0.05


def test_the_ground_carries_the_weight_and_a_slope_pulls():
    model, data = in_mujoco(Scene())
    mujoco.mj_step(model, data, 1000)
    heights = links(model, data)[:, 2]
    np.testing.assert_allclose(heights, 0.0525, atol=1e-3)
    steep = in_mujoco(Scene(slope=(0.3, 0.5 * np.pi)))[0].opt.gravity
    np.testing.assert_allclose(steep, 9.81 * np.array([0.0, -np.sin(0.3), -np.cos(0.3)]), atol=1e-12)


def test_obstacles_stop_a_robot():
    """A straight robot slides against each kind of obstacle; it does not get through."""
    kinds = [
        (0.1, 0.5, 0.0),
        Box(size=(0.2, 0.2), x=0.5, y=0.0),
        Segment(start=(0.4, -0.5), end=(0.4, 0.5)),
        Polygon(vertices=[(0.4, -0.3), (0.6, 0.0), (0.4, 0.3)]),
    ]
    for obstacle in kinds:
        scene = Scene(obstacles=[obstacle], friction=(0.0, 0.0))
        model, data = in_mujoco(scene, start=Start(heading=np.pi, posture="straight"))
        data.qvel[0] = 0.5
        mujoco.mj_step(model, data, 1000)
        # Its face is at x = 0.4 m, and the leading link ends 0.0918 m before its CG.
        assert links(model, data)[:, 0].max() < 0.4 - 0.0918 + 0.01, obstacle
        open_ground = 0.5 * model.opt.timestep * 1000
        assert open_ground > 0.4, "it would have got there"


def waves():
    """Heights from 0 to 0.09 m above the plane, of slopes up to 0.35, on 41 x 36 points."""
    x, y = np.meshgrid(0.1 * np.arange(41) - 2.0, 0.1 * np.arange(36) - 1.5, indexing="ij")
    height = 0.03 * np.cos(2.0 * np.pi * x / 1.1 + 0.3) * np.cos(2.0 * np.pi * y / 0.9) + 0.01 * x
    return height - height.min()


def uneven(friction):
    field = HeightField(height=waves().tolist(), spacing=0.1, origin=(-2.0, -1.5))
    return Scene(obstacles=[field], friction=(friction, friction), rolling_friction=0.0)


@pytest.mark.parametrize(
    ("friction", "gait", "seconds", "apart", "heights_apart"),
    [
        # Without friction 0.04 mm apart while links move by 64 mm.
        (0.0, Gait.lateral_undulation(), 0.3, 1e-4, 1e-4),
        # Landing with friction, which the two programs solve by different laws of impact, shifts links by 0.5 mm.
        (0.4, Gait(amplitude=0.0), 1.0, 1e-3, 2e-4),
    ],
)
def test_a_robot_on_a_height_field_moves_as_in_mujoco(friction, gait, seconds, apart, heights_apart):
    """At time steps of 0.1 ms; an independent program for geometry and mechanics of a field."""
    scene, controller, start = uneven(friction), PD(kp=40.0, kd=1.5), Start(position=(0.6, 0.1), heading=0.2)
    options = {"gait": gait, "controller": controller, "start": start}
    run = simulate(model="spatial", scene=scene, duration=seconds, integrator=Integrator(precision="fine"), **options)
    model, data = in_mujoco(scene, step=1e-4, **options)
    np.testing.assert_allclose(links(model, data), run.position[0], atol=1e-9)
    advance(model, data, seconds, servo_targets(gait, controller))
    difference = np.abs(links(model, data) - run.position[-1]).max(axis=0)
    assert np.abs(run.position[-1] - run.position[0]).max() > 0.03
    assert (difference < [apart, apart, heights_apart]).all(), difference


def test_a_robot_pushes_a_box_in_3d_as_in_mujoco():
    """Without friction; the side of an undulating robot meets the box off its centre and turns it."""
    box = Box((0.15, 0.1), 0.7, -0.3, 0.3, mass=0.5, ground_friction=0.0)
    scene, gait, controller = Scene(obstacles=[box], friction=(0.0, 0.0)), Gait(), PD(kp=40.0, kd=1.5)
    options = {"gait": gait, "controller": controller, "start": Start(position=(0.2, 0.0), heading=0.0)}
    fine = Integrator(precision="fine")
    run = simulate(model="spatial", scene=scene, duration=0.7, sample=0.1, integrator=fine, **options)
    model, data = in_mujoco(scene, step=1e-4, **options)
    body, places, turns = data.body("obstacle_1"), [], []
    for _ in range(8):
        places.append(body.xpos[:2].copy())
        turns.append(np.arctan2(body.xmat[3], body.xmat[0]) - box.angle)
        advance(model, data, 0.1, servo_targets(gait, controller))
    assert run.obstacle_position[-1, 0, 0] > box.x + 0.05
    assert run.obstacle_angle[-1, 0] < -0.4
    np.testing.assert_allclose(run.obstacle_position[:, 0], places, atol=1e-4)
    np.testing.assert_allclose(run.obstacle_angle[:, 0], turns, atol=2e-3)


def test_a_robot_pushes_a_ball_as_in_mujoco():
    """The side of an undulating robot that slides without friction meets a ball that rolls."""
    ball = Sphere(0.08, 0.7, -0.3, 0.5, ground_friction=0.8, rolling_friction=0.01)
    scene, gait, controller = Scene(obstacles=[ball], friction=(0.0, 0.0)), Gait(), PD(kp=40.0, kd=1.5)
    options = {"gait": gait, "controller": controller, "start": Start(position=(0.2, 0.0), heading=0.0)}
    fine = Integrator(precision="fine")
    run = simulate(model="spatial", scene=scene, duration=1.0, sample=0.1, integrator=fine, **options)
    model, data = in_mujoco(scene, step=1e-4, **options)
    places = []
    for _ in range(11):
        places.append(data.body("obstacle_1").xpos.copy())
        advance(model, data, 0.1, servo_targets(gait, controller))
    assert run.obstacle_position[-1, 0, 0] > ball.x + 0.08
    np.testing.assert_allclose(run.obstacle_position[:, 0], np.array(places)[:, :2], atol=2e-4)
    np.testing.assert_allclose(run.obstacle_height[:, 0], np.array(places)[:, 2], atol=2e-4)


def test_convex_bodies_and_poles_have_their_places():
    ramp = Polyhedron(vertices=[(1, -1, 0), (2, -1, 0), (2, 1, 0), (1, 1, 0), (2, -1, 0.4), (2, 1, 0.4)], friction=0.5)
    pole = Cylinder(start=(0.0, 1.0, 0.0), end=(0.3, 1.0, 1.0), radius=0.1)
    model, data = in_mujoco(Scene(obstacles=[ramp, pole]), start=Start(position=(-1.0, 0.0)))
    geom = np.zeros(1, np.int32)
    for place, direction, hit, distance in (
        ((1.5, 0.3, 3.0), (0.0, 0.0, -1.0), "obstacle_1", 2.8),
        ((0.15, 3.0, 0.5), (0.0, -1.0, 0.0), "obstacle_2", 1.9),
    ):
        way = mujoco.mj_ray(model, data, np.array(place), np.array(direction), None, 1, 1, geom, None)
        assert (model.geom(geom[0]).name, way) == (hit, pytest.approx(distance, abs=1e-6))
    assert model.geom("obstacle_1").friction[0] == 0.5


def rubble(rng, field):
    """Uneven ground, convex bodies and poles in any direction around a robot that starts at the origin."""
    found = [field] if field else []
    while len(found) < 9:
        place = np.append(rng.uniform(-1.2, 1.2, 2), rng.uniform(0.0, 0.1))
        if np.hypot(*place[:2]) < 0.5:
            continue
        found.append(Polyhedron(place + rng.uniform(-0.2, 0.2, (6, 3))))
        end = place + rng.uniform(-0.3, 0.3, 3)
        found.append(Cylinder(-place, -end, radius=rng.uniform(0.03, 0.1)))
    return found


@pytest.mark.parametrize("has_field", [False, True])
def test_rays_over_uneven_ground_and_among_bodies_are_those_of_mujoco(has_field):
    rng, hits = np.random.default_rng(8), 0
    # Level below the robot, and rising around it.
    x, y = np.meshgrid(0.07 * np.arange(41) - 1.4, 0.07 * np.arange(41) - 1.4, indexing="ij")
    height = 0.15 * np.clip(np.hypot(x, y) - 0.2, 0.0, 1.0) * (1.0 + np.cos(9.0 * x) * np.cos(7.0 * y))
    field = HeightField(height=height, spacing=0.07, origin=(-1.4, -1.4), friction=0.3) if has_field else None
    robot = Robot(links=3, length=0.3)
    for _ in range(30):
        scene = Scene(obstacles=rubble(rng, field))
        start = Start(position=(0.0, 0.0), heading=rng.uniform(-3.0, 3.0), posture="straight")
        keywords = {"model": "spatial", "task": "field", "robot": robot, "start_jitter": 0.0}
        env = SnakeEnv(**keywords, scene=scene, start=start, observation_blocks=["range"])
        try:
            observation, _ = env.reset(seed=0)
        except ConfigError:
            continue  # It would start inside something.
        state = env.state()
        model, data = in_mujoco(scene, robot=robot, start=start)
        robots = [model.body(f"link_{i}").id for i in (1, 2, 3)]
        model.geom_group[:] = np.where(np.isin(model.geom_bodyid, robots), 5, 0)
        turn = np.arctan2(-state.link_axis[0, 1], -state.link_axis[0, 0]) + np.linspace(-0.5, 0.5, 9) * np.pi
        for angle, found in zip(turn, observation * env.layout["observation"][0]["scale"], strict=True):
            ray, groups = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([1, 1, 1, 1, 1, 0], np.uint8)
            way = mujoco.mj_ray(model, data, state.link_position[0], ray, groups, 1, -1, np.zeros(1, np.int32), None)
            expected = min(way if way >= 0.0 else np.inf, robot.length * 3)
            # MuJoCo keeps the heights and the vertices of meshes in single precision.
            assert found == pytest.approx(expected, abs=2e-5)
            hits += expected < robot.length * 3 - 1e-3
    assert hits > 25


@pytest.mark.parametrize(
    ("scene", "options", "field"),
    [
        (Scene(obstacles=[Box(size=(0.2, 0.2), x=0.5, y=0.0, height=0.1)], friction=(0.2, 0.5)), {}, "scene.friction"),
        (Scene(obstacles=[FIELD], friction=(0.2, 0.5)), {}, "scene.friction"),
        (Scene(obstacles=[dataclasses.replace(FIELD, friction=[[0.2]])]), {}, r"scene.obstacles\[0\].friction"),
        (Scene(obstacles=[dataclasses.replace(FIELD, height=[[0, 0], [0, -0.1]])]), {}, r"scene.obstacles\[0\].height"),
        (Scene(obstacles=[(0.1, 1, 1), Cylinder((0, 2, 0.5), (1, 2, 0.5), 0.2, inside=True)]), {}, r"\[1\].inside"),
        (Scene(stribeck=Stribeck(drop=0.3)), {}, "scene"),
        (Scene(viscous=(0.1, 0.1)), {}, "scene"),
        (Scene(spin_friction=0.05), {}, "scene.spin_friction"),
        (Scene(friction_law="ellipse"), {}, "scene.friction_law"),
        (Scene(), {"robot": Robot.aiko()}, "robot.backlash"),
        (Scene(), {"robot": Robot(link_friction=0.1)}, "robot.link_friction"),
        (Scene(friction=(0.2, 0.5)), {"robot": Robot(contact_half_length=0.0)}, "robot.contact_half_length"),
        (Scene(), {"controller": PD(active_from=0.1)}, "controller.active_from"),
        (Scene(), {"controller": PD(treatment="step")}, "controller.treatment"),
        (Scene(), {"start": Start(posture=[0.1])}, "start.posture"),
        (Scene(), {"step": 0.0}, "step"),
    ],
)
def test_what_mujoco_does_not_have_is_refused_by_name(scene, options, field):
    with pytest.raises(ConfigError, match=field):
        scene.to_mjcf(**options)


@pytest.mark.parametrize(
    ("section", "carried", "refused", "left_out"),
    [
        (
            Robot,
            "links length contact_half_length radius mass cg_offset inertia roll_inertia gravity self_contact "
            "joint_limit axes locked limp kp kd torque_limit friction_factor motor",
            "backlash link_friction",
            "",
        ),
        # Smoothing is that of the laws that are refused, and a course the name of a preset.
        (
            Scene,
            "obstacles friction slope",
            "friction_backward spin_friction stribeck patches viscous friction_law",
            "rolling_friction smoothing course",
        ),
        (PD, "kp kd torque_limit", "active_from treatment", "law"),
    ],
)
def test_every_field_is_carried_or_refused_or_known_to_be_left_out(section, carried, refused, left_out):
    known = " ".join((carried, refused, left_out)).split()
    assert sorted(known) == sorted(field.name for field in dataclasses.fields(section))


def test_each_axis_has_its_gains_and_its_torque_as_in_mujoco():
    """In the air, from a bent posture, with small steps."""
    robot = Robot(
        links=4,
        gravity=1e-9,
        joint_limit=np.inf,
        self_contact=False,
        kp=[(0.4, 0.1), 0.2, 0.05],
        kd=[0.002, (0.001, 0.003), 0.0],
        torque_limit=[np.inf, (0.03, np.inf), 0.01],
    )
    bent = np.array([[0.3, -0.2], [0.4, 0.1], [-0.3, 0.4]])
    start = Start(position=(0.0, 0.0, 1.0), posture=bent)
    run = simulate(
        model="spatial",
        robot=robot,
        start=start,
        gait=JointTrajectory([0.0, 9.0], np.zeros((2, 3, 2))),
        duration=0.2,
        sample=0.2,
        integrator=Integrator(step=5e-4),
    )
    model, data = in_mujoco(Scene(), robot=robot, start=start, step=1e-4)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT
    data.ctrl[:] = 0.0
    advance(model, data, 0.2)
    assert np.abs(run.joint_angle[1] - bent).min() > 0.02
    np.testing.assert_allclose(data.qpos[7:], run.joint_angle[1].ravel(), atol=5e-4)


def test_each_link_has_its_skin():
    """A straight robot slides down where the slope exceeds the mean of its coefficients, symmetric as loads shift."""
    robot = Robot(links=4, inertia=1e3, roll_inertia=1e3, friction_factor=[2.5, 0.5, 0.5, 2.5])
    for share in (0.97, 1.05):
        scene = Scene(friction=(0.2, 0.2), slope=(np.arctan(1.5 * 0.2 * share), 0.0), rolling_friction=0.0)
        model, data = in_mujoco(scene, robot=robot, start=Start(heading=0.0, posture="straight"))
        advance(model, data, 0.5)
        before = links(model, data)
        advance(model, data, 1.0)
        assert (np.hypot(*(links(model, data) - before)[0, :2]) > 1e-4) == (share > 1.0)
