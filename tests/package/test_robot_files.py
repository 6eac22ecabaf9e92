"""Robots from files in MJCF and URDF."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import advance

from snake_env import PD, ConfigError, Integrator, JointTrajectory, Motor, Robot, Scene, Start, simulate
from snake_env.config.robot import per_link
from snake_env.obstacles import Box

mujoco = pytest.importorskip("mujoco")


@pytest.fixture
def from_text(tmp_path):
    """A robot from the text of a file."""

    def read(text, name="snake.xml", **options):
        (tmp_path / name).write_text(text)
        return (Robot.from_urdf if name.endswith("urdf") else Robot.from_mjcf)(tmp_path / name, **options)

    return read


QUANTITIES = ("length", "mass", "inertia", "roll_inertia", "radius", "contact_half_length", "cg_offset")
UNEVEN = np.linspace(1.0, 1.5, 7)


def bounds(robot):
    """Limits of all joints (n - 1, 2)."""
    limit = np.pi / 2 if robot.joint_limit is None else robot.joint_limit
    each = limit if isinstance(limit, tuple) else [limit] * (robot.links - 1)
    return np.array([one if isinstance(one, tuple) else (-one, one) for one in each])


@pytest.mark.parametrize(
    "robot",
    [
        Robot(),
        Robot(links=2, axes="yaw", gravity=3.7),
        Robot(links=7, axes=["yaw", "pitch"] * 3, **dict.fromkeys(QUANTITIES, 0.1 * UNEVEN) | {"length": UNEVEN}),
        Robot(links=4, axes="yaw", cg_offset=[-0.05, 0.02, 0.0, 0.06]),
        Robot(links=3, axes="yaw", contact_half_length=[0.03, 0.0, 0.0]),
        Robot(links=6, axes=["yaw", "roll", (1.0, 2.0, 3.0), "both", (0.0, -1.0, 0.0)], self_contact=False),
        Robot(links=5, axes=["pitch", "yaw", "both", "roll"], joint_limit=[(-0.3, 1.2), 0.4, (0.0, 1.0), np.inf]),
        Robot(links=5, axes=["pitch", "yaw", "both", "both"], locked=(0, 2), limp=(3,)),
        Robot(
            links=5,
            axes=["yaw", "both", "pitch", "both"],
            kp=[10.0, (20.0, 30.0), 0.0, 40.0],
            kd=[0.1, 0.2, 0.0, (0.4, 0.5)],
            torque_limit=[1.0, (2.0, np.inf), np.inf, 3.0],
            limp=(2,),
        ),
        Robot(links=4, limp=(1,), motor=Motor(rotor_inertia=1e-3, gear_friction=0.1, gear_damping=0.02)),
        Robot(
            links=5,
            axes=["yaw", "both", "pitch", "both"],
            motor=[Motor(rotor_inertia=1e-3), (Motor(gear_friction=0.1), Motor(gear_damping=0.02)), Motor(), Motor()],
            limp=(2,),
        ),
    ],
    ids=["aiko", "two", "uneven", "offset", "spheres", "axes", "limits", "broken", "gains", "motor", "motors"],
)
def test_a_robot_survives_the_way_through_a_file(robot, from_text):
    """Of scenes on a slope, with obstacles, at any place."""
    scene = Scene(obstacles=[(0.1, 1.0, 1.0), Box((0.1, 0.2), 2.0, 0.0, height=0.1)], slope=(0.2, 1.0))
    found = from_text(scene.to_mjcf(robot, start=Start(position=(0.3, -0.2), heading=1.0, posture="straight")))
    for name in QUANTITIES:
        given, again = (per_link(getattr(one, name), robot.links) for one in (robot, found))
        np.testing.assert_allclose(again, given, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(bounds(found), bounds(robot), rtol=0.0, atol=1e-12)
    assert found.gravity == pytest.approx(robot.gravity, abs=1e-12)
    assert found.self_contact is robot.self_contact
    assert (found.locked, found.limp, found.motor) == (robot.locked, robot.limp, robot.motor)
    assert (found.kp, found.kd, found.torque_limit) == (robot.kp, robot.kd, robot.torque_limit)
    assert (found.axes == "both") == (robot.axes == "both")
    for (joint, axis), (given_joint, given) in zip(found.joint_axes, robot.joint_axes, strict=True):
        assert joint == given_joint
        assert axis == (given if isinstance(given, str) else pytest.approx(given / np.linalg.norm(given), abs=1e-12))


def test_aiko_comes_back_as_it_is_written(from_text):
    assert from_text(Scene().to_mjcf(Robot()), backlash=0.1) == Robot(backlash=0.1, joint_limit=np.pi / 2)


def test_the_angle_of_a_lock_is_that_of_the_start(from_text):
    robot = Robot(links=4, axes="yaw", locked=(1,))
    document = Scene().to_mjcf(robot, start=Start(posture=[0.1, 0.2, 0.3]))
    with pytest.warns(UserWarning, match=r'left out angle of the lock of joint "yaw_2" \(0\.2 rad, the start\'s\)$'):
        assert from_text(document).locked == (1,)


@pytest.mark.parametrize(
    ("actuators", "limp", "left_out"),
    [
        ("", (), None),
        ('<motor joint="yaw_1"/><motor joint="yaw_3"/><motor joint="pitch_3"/>', (1,), None),
        ('<motor joint="yaw_1"/><motor joint="yaw_2"/><motor joint="yaw_3"/>', (), "pitch_3"),
        ('<motor joint="yaw_1"/><motor joint="yaw_3"/><motor joint="pitch_3"/><motor tendon="t"/>', (), "yaw_2"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_joints_that_nothing_drives_are_limp(actuators, limp, left_out, from_text):
    document = Scene().to_mjcf(Robot(links=4, axes=["yaw", "yaw", "both"], limp=(0, 1, 2)))
    tendon = '<tendon><fixed name="t"><joint joint="yaw_2" coef="1"/></fixed></tendon>' if "tendon" in actuators else ""
    text = document.replace("<actuator />", f"<actuator>{actuators}</actuator>{tendon}").replace(' ctrl=""', "")
    if left_out is None:
        assert from_text(text).limp == limp
        return
    with pytest.warns(UserWarning, match=rf'left out that no actuator drives joint "{left_out}" \(limp= says so\)'):
        assert from_text(text).limp == limp


LENGTH, RADIUS, SIDE, DENSITY = 0.08, 0.02, 0.03, 900.0
CAPSULE = f'type="capsule" size="{RADIUS}" fromto="0.01 0 0 0.07 0 0"'


def modules(count=5, turn="0 0 -90"):
    """Modules that are turned about their length, each against the one before: all joints have one local axis."""
    text = '<mujoco><compiler angle="degree" autolimits="true"/><default><joint axis="0 1 0" range="-60 45"/>'
    text += f'<default class="module"><geom {CAPSULE} density="{DENSITY}"/></default></default><worldbody>'
    text += f'<geom type="plane" size="1 1 1"/><body name="b1" pos="0.3 0.2 1" euler="{turn}"><freejoint/>'
    for i in range(2, count + 1):
        text += (
            f'<geom class="module"/><body name="b{i}" pos="{LENGTH} 0 0" euler="{90 if i % 2 else -90} 0 0"><joint/>'
        )
    return text + '<geom class="module"/>' + "</body>" * count + "</worldbody></mujoco>"


def capsule():
    """Mass, and inertia across and along, of a capsule of even density."""
    side, ball = np.pi * RADIUS**2 * 2 * SIDE * DENSITY, 4 / 3 * np.pi * RADIUS**3 * DENSITY
    # A half ball has its CG 3/8 of the radius from its face.
    of_ball = 0.4 * RADIUS**2 - (0.375 * RADIUS) ** 2 + (SIDE + 0.375 * RADIUS) ** 2
    across = side * (RADIUS**2 / 4 + (2 * SIDE) ** 2 / 12) + ball * of_ball
    return side + ball, across, RADIUS**2 * (side / 2 + 0.4 * ball)


def test_modules_that_are_turned_against_each_other_have_alternating_axes(from_text):
    robot = from_text(modules())
    assert robot.links == 5
    assert robot.length == LENGTH
    assert robot.radius == RADIUS
    np.testing.assert_allclose(per_link(robot.contact_half_length, 5), SIDE, atol=1e-12)
    found = [per_link(getattr(robot, name), 5) for name in ("mass", "inertia", "roll_inertia")]
    np.testing.assert_allclose(found, np.tile(np.array(capsule())[:, None], 5), rtol=1e-9)
    # The axis y of module 1 points across the link, that of module 2 down.
    assert robot.axes == ((0.0, -1.0, 0.0), "pitch") * 2
    np.testing.assert_allclose(bounds(robot), np.tile(np.radians([-60.0, 45.0]), (4, 1)), atol=1e-12)
    changed = from_text(modules(), joint_limit=1.0, axes=["yaw", "pitch"] * 2, mass=2.0)
    assert (changed.joint_limit, changed.axes, changed.mass) == (1.0, ("yaw", "pitch") * 2, 2.0)


def test_a_robot_that_stands_upright_has_x_of_the_world_up(from_text):
    # The axis y of module 2 is x of the world, that of module 1 its y, and x of the links is -y.
    assert from_text(modules(turn="0 -90 0")).axes == ("yaw", (-1.0, 0.0, 0.0)) * 2


def test_a_chain_from_a_file_flies_as_in_mujoco(tmp_path, from_text):
    """Springs in the joints bend it back, far from the ground."""
    bent, spring = np.array([0.4, -0.3, 0.5, 0.2]), 0.02
    robot = from_text(modules(), gravity=1e-9, joint_limit=np.inf, self_contact=False)
    run = simulate(
        model="spatial",
        robot=robot,
        start=Start(position=(0.3, 0.2, 1.0), heading=-0.5 * np.pi, posture=bent),
        gait=JointTrajectory([0.0, 9.0], np.zeros((2, 4))),
        controller=PD(kp=spring, kd=0.0),
        duration=0.3,
        sample=0.3,
        integrator=Integrator(step=5e-4),
    )
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "snake.xml"))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-3
    model.opt.gravity[:], model.jnt_limited[:], model.jnt_stiffness[1:] = 0.0, 0, spring
    data = mujoco.MjData(model)
    data.qpos[7:] = bent

    def links():
        mujoco.mj_forward(model, data)
        return data.xipos[1:].copy()

    offset = links()[0] - run.position[0, 0]
    np.testing.assert_allclose(links() - offset, run.position[0], atol=1e-9)
    advance(model, data, 0.3)
    assert np.abs(run.joint_angle[1] - bent).max() > 0.3
    np.testing.assert_allclose(data.qpos[7:], run.joint_angle[1], atol=1e-4)
    np.testing.assert_allclose(links() - offset, run.position[1], atol=1e-5)


YAW, PITCH, BALL = '<joint axis="0 0 1"/>', '<joint axis="0 1 0"/>', '<geom type="sphere" size="0.03" mass="1"'
AT, AWAY = ' pos="0.05 0 0"/>', ' contype="0" conaffinity="0"/>'


OUTLINE = {"radius": 0.03, "contact_half_length": 0.0}


def chain(inside="", joints=YAW, tail="", root="<freejoint/>"):
    """Two balls with joints between them; what is ``inside`` the second one, and what follows the bodies."""
    text = f'<mujoco><compiler angle="radian"/><worldbody><body name="a">{root}{BALL}/>'
    text += f'<body name="b" pos="0.05 0 0">{joints}{BALL}{AT}{inside}</body></body></worldbody>{tail}</mujoco>'
    return text


def body(name, joints, inside=BALL + AT, x=0.1):
    return f'<body name="{name}" pos="{x} 0 0">{joints}{inside}</body>'


def test_two_hinges_of_a_body_are_a_cardan_joint(from_text):
    assert from_text(chain(joints=YAW + PITCH)).axes == "both"


def test_the_cross_of_a_cardan_joint_belongs_to_the_link_behind_it(from_text):
    cross = body("cross", YAW, BALL.replace('"1"', '"1e-9"') + AWAY + body("c", PITCH, x=0.0))
    with pytest.warns(UserWarning, match=r'left out the motion of body "cross" \(1e-09 kg\) in the link behind it$'):
        robot = from_text(chain(cross))
    assert (robot.links, robot.axes, robot.mass) == (3, ("yaw", "both"), (1.0, 1.0, 1.0 + 1e-9))


def test_bodies_without_joints_belong_to_their_link(from_text):
    """Two balls 40 mm apart; the way to the second one is not straight."""
    half = BALL.replace('"1"', '"0.5"')
    place = f"{0.07 - 0.1 * np.cos(0.3)} {-0.1 * np.sin(0.3)} 0"
    lid = f'<body pos="{place}" euler="0 0 0.3"><body pos="0.1 0 0" euler="0 0 -0.3">{half}/></body></body>'
    robot = from_text(chain(body("c", PITCH, half + ' pos="0.03 0 0"/>' + lid)), **OUTLINE)
    assert robot.links == 3
    ball = 0.4 * 0.03**2
    np.testing.assert_allclose(robot.mass, 1.0, rtol=1e-9)
    np.testing.assert_allclose(robot.inertia, [ball, ball, ball + 0.02**2], rtol=1e-9)
    np.testing.assert_allclose(robot.roll_inertia, ball, rtol=1e-9)


INERTIAL = """<inertial><origin xyz="{} 0 0"/><mass value="0.5"/>
<inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>"""
ARM = """<robot name="arm"><link name="base">{}</link><link name="middle">{link}</link><link name="tip">{link}</link>
<link name="camera"/><joint name="glue" type="fixed"><parent link="middle"/><child link="camera"/></joint>
<joint name="pan" type="revolute"><parent link="base"/><child link="middle"/><origin xyz="0.05 0 0" rpy="1.5708 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1.5" effort="3" velocity="2"/>
<dynamics damping="0.1" friction="0.2"/></joint>
<joint name="tilt" type="continuous"><parent link="middle"/><child link="tip"/><origin xyz="0.1 0 0" rpy="-1.5708 0 0"/>
<axis xyz="0 1 0"/></joint></robot>"""
BASE = """<collision><origin rpy="0 1.5707963 0"/><geometry>
<cylinder radius="0.03" length="0.1"/></geometry></collision>"""
LINK = """<collision><origin xyz="0.05 0 0"/><geometry><sphere radius="0.04"/></geometry></collision>"""
LINK += INERTIAL.format(0.05)


def test_the_root_link_of_a_urdf_file_is_link_1(from_text):
    robot = from_text(ARM.format(INERTIAL.format(0) + BASE, link=LINK), "arm.urdf")
    assert robot.motor == (Motor(gear_friction=0.2, gear_damping=0.1), Motor())
    np.testing.assert_allclose(per_link(robot.inertia, 3), 0.002, rtol=1e-9)
    np.testing.assert_allclose(per_link(robot.roll_inertia, 3), 0.001, rtol=1e-9)
    assert (robot.links, robot.length, robot.mass, robot.axes) == (3, 0.1, 0.5, ("yaw", "pitch"))
    assert (robot.radius, robot.contact_half_length) == ((0.03, 0.04, 0.04), (0.05, 0.0, 0.0))
    assert (robot.joint_limit, robot.torque_limit) == (((-1.0, 1.5), np.inf), (3.0, np.inf))


def test_a_root_link_without_mass_is_the_world(from_text):
    with pytest.warns(UserWarning, match=r'left out joint "pan", between the robot and the world'):
        robot = from_text(ARM.format("", link=LINK), "arm.urdf")
    assert (robot.links, robot.axes) == (2, "pitch")


LIMIT = '<limit lower="-1" upper="1.5" effort="3" velocity="2"/>'


@pytest.mark.parametrize(
    ("limit", "value"),
    [
        ('<limit lower="0" upper="0" effort="3" velocity="2"/>', "(0, 0)"),
        ('<limit effort="3" velocity="2"/>', "(0, 0)"),
        ("", "(0, 0)"),
        ('<limit lower="1.5" upper="-1"/>', "(1.5, -1)"),
        ('<limit lower="-3.14159" upper="3.14159"/>', "(-3.14159, 3.14159)"),
        ('<limit lower="0" upper="6.28"/>', "(0, 6.28)"),
    ],
)
@pytest.mark.filterwarnings("ignore:arm.urdf")
def test_limits_in_a_urdf_file_that_no_joint_can_have_are_refused_by_joint(limit, value, from_text):
    text = ARM.format(INERTIAL.format(0) + BASE, link=LINK).replace(LIMIT, limit)
    with pytest.raises(ConfigError) as caught:
        from_text(text, "arm.urdf")
    assert f'arm.urdf, body "middle", joint "pan" = limits {value} rad: expected ' in str(caught.value)
    assert from_text(text, "arm.urdf", joint_limit=1.0).joint_limit == 1.0
    assert from_text(text.replace("revolute", "continuous"), "arm.urdf").joint_limit == np.inf


@pytest.mark.filterwarnings("ignore:arm.urdf")
def test_joints_without_limits_in_a_urdf_file_that_is_not_well_formed_are_refused(from_text):
    """MuJoCo takes a comment with two hyphens; whether the joint has limits cannot be told."""
    text = ARM.format(INERTIAL.format(0) + BASE, link=LINK).replace("</robot>", "<!-- a -- b --></robot>")
    with pytest.raises(ConfigError, match=r"path = .*arm\.urdf: expected well-formed XML \(ParseError: "):
        from_text(text, "arm.urdf")
    assert from_text(text, "arm.urdf", joint_limit=1.0).links == 3


def third(inside=BALL + AT, joints=PITCH):
    return chain(body("c", joints, inside))


BENT = chain(body("c", PITCH, BALL + AT + body("d", YAW)).replace('"0.1 0 0"', '"0.1 0 0.02"', 1))
INERTIA = '<inertial pos="0.05 0 0" mass="1" diaginertia="1e-3 2e-3 {}e-3"/>'
CUBE = '<geom type="box" size="0.03 0.03 0.03" mass="1" pos="0.05 0 0"/>'


PITCH_AWAY = '<joint axis="0 1 0" pos="2e-6 0 0"/>'
OFF = '<option><flag {}="disable"/></option>'


@pytest.mark.parametrize(
    ("text", "message", "instead"),
    [
        (chain(body("c", YAW) + body("d", YAW)), ', body "b" = body "c" and body "d": expected one body', {}),
        (chain(joints=""), " = one link: expected a chain of at least two links", {}),
        (f"<mujoco><worldbody>{BALL}/></worldbody></mujoco>", ', body "world" = no body that moves', {}),
        (chain(joints=YAW + PITCH_AWAY), ', body "b", joint 2 (without a name) = 2e-06 m apart', {"tolerance": 3e-6}),
        (chain(tail=OFF.format("gravity")), ", option gravity = 0.0: expected a vector other than", {"gravity": 9.81}),
        (third(joints='<joint name="r" type="slide"/>'), ', body "c", joint "r" = slide: expected a hinge', {}),
        (third(joints='<joint name="r" type="ball"/>'), ', body "c", joint "r" = ball: expected a hinge', {}),
        (chain(joints=PITCH + YAW), ', body "b", joint 2 (without a name) = axes pitch, yaw: expected one', {}),
        (chain(joints=YAW * 3), ', body "b", joint 3 (without a name) = axes yaw, yaw, yaw: expected one', {}),
        (
            chain(tail='<equality><connect name="loop" body1="a" body2="b" anchor="0 0 0"/></equality>'),
            ', equality "loop" = 1 in all: expected links and hinges only',
            {},
        ),
        (chain(body("c", PITCH, x=-0.1)), ', body "a" = length -0.1 m: expected > 0', {"length": 0.1}),
        (BENT, ', body "c", joint 2 (without a name) = 0.00995037 m off the line: ', {"tolerance": 0.03}),
        (
            third(BALL + ' pos="0.05 0 2e-6"/>'),
            ', body "c" = CG 2e-06 m off the line: expected at',
            {"tolerance": 3e-6},
        ),
        (
            third(INERTIA.format(2.5) + BALL + AT),
            ', body "c" = inertia (xx yy zz xy xz yz, z along) 0.002 0.0025 0.001 0 0 0 kg m^2: expected equal',
            {"inertia": 2e-3, "roll_inertia": 1e-3},
        ),
        (third(INERTIA.format(2)), ', body "c" = no geom: expected one capsule, cylinder or sphere, or rad', OUTLINE),
        (third(BALL + AT + BALL + AT), ', body "c" = sphere and sphere: expected one capsule', OUTLINE),
        (third(CUBE), ', body "c" = box: expected one capsule, cylinder or sphere', OUTLINE),
        (
            third(INERTIA.format(2) + '<geom name="g" type="capsule" size="0.02 0.03" pos="0.05 0 0"/>'),
            ', body "c", geom "g" = capsule 0.03 m aside: expected one around the middle of the link',
            OUTLINE,
        ),
        (
            third(joints='<joint name="p" axis="0 1 0" range="0.1 0.5" limited="true"/>'),
            ', body "c", joint "p" = limits (0.1, 0.5) rad: expected lower <= 0 <= upper',
            {"joint_limit": 1.0},
        ),
        (
            third(joints=YAW + '<joint name="p" axis="0 1 0" range="-1 1" limited="true"/>'),
            ', body "c", joint "p" = limits (-1, 1) rad: expected lower <= 0 <= upper, equal for both axes',
            {"joint_limit": 1.0},
        ),
        (
            third(joints='<joint name="p" axis="0 1 0" range="0.5 -0.5"/>'),
            ', body "c", joint "p" = limits (0.5, -0.5) rad: expected lower < upper',
            {"joint_limit": 1.0},
        ),
        (
            third(joints='<joint name="p" axis="0 1 0" range="-3.14 3.14"/>'),
            ', body "c", joint "p" = limits (-3.14, 3.14) rad: expected within [-3.13, 3.13], no limit, or',
            {"joint_limit": 1.0},
        ),
        (chain(tail='<option gravity="0 0 0"/>'), ", option gravity = 0.0: expected a vector other", {"gravity": 9.81}),
    ],
)
def test_what_is_no_robot_is_refused_by_name(text, message, instead, from_text):
    """And taken where keywords replace it."""
    with pytest.raises(ConfigError) as caught:
        from_text(text)
    assert f"snake.xml{message}" in str(caught.value)
    if instead:
        assert from_text(text, **instead).links >= 2


def test_limits_count_from_the_straight_robot(from_text):
    ref = '<joint axis="0 1 0" ref="0.2" range="0.1 0.5" limited="true"/>'
    np.testing.assert_allclose(bounds(from_text(third(joints=ref)))[1], [-0.1, 0.3], atol=1e-12)


def test_the_largest_limit_in_a_file_is_that_of_the_spatial_model(from_text):
    robot = from_text(third(joints=PITCH.replace("/>", ' range="-3.13 3.13"/>')))
    assert robot.joint_limit == (np.inf, 3.13)
    simulate(model="spatial", robot=robot, start=Start(posture="straight"), duration=0.1)


FRONT = INERTIA.format(2).replace("0.05", "{}") + BALL + AT


def test_cgs_are_where_they_are_on_the_line(from_text):
    """In front of the middle towards the head, link by link; the outline is the middle of a link at an end."""
    text = chain(body("c", PITCH, FRONT.format(0.065)))
    assert from_text(text).cg_offset == (0.0, 0.0, -0.015)
    assert from_text(text, cg_offset=0.01).cg_offset == 0.01
    assert from_text(text, length=0.1, **OUTLINE).cg_offset == 0.0
    # Without outlines the CG at an end is the middle.
    assert from_text(text, **OUTLINE).length == (0.1, 0.1, 0.13)
    off = "CG 0.06 m off the middle of the link: expected less than half of its length, 0.05 m; or length="
    with pytest.raises(ConfigError, match=f'body "c" = {off}'):
        from_text(chain(body("c", PITCH, FRONT.format(-0.01))))


def test_cgs_aside_of_the_line_are_refused_whatever_the_length(from_text):
    with pytest.raises(ConfigError, match=r'body "c" = CG 0\.04 m off the line'):
        from_text(third(BALL + ' pos="0.05 0 0.04"/>'), length=0.1)


@pytest.mark.parametrize("friction", [(0.3, 0.3), (0.2, 0.5)])
def test_skins_of_links_survive_the_way_through_a_file(friction, from_text):
    robot = Robot(links=6, friction_factor=[2.0, 1.0, 1.0, 0.5, 0.0, 1.0])
    found = from_text(Scene(friction=friction).to_mjcf(robot))
    np.testing.assert_allclose(found.friction_factor, robot.friction_factor, rtol=0.0, atol=1e-12)


def test_friction_between_links_and_ground_is_mixed_as_in_mujoco(from_text):
    """Of geoms of one priority the larger coefficient holds, else that of the geom with the higher priority."""
    balls = [BALL + f' friction="{mu}"' for mu in (0.2, 0.4, 0.9)]
    links = f'<body name="a">{balls[0]}/><body name="b" pos="0.05 0 0">{YAW}{balls[1]}{AT}'
    links += f'<body name="c" pos="0.1 0 0">{PITCH}{balls[2]}{AT}</body></body></body>'
    for plane, expected in (
        ("", (0.5, 1.0, 2.25)),
        ('friction="0.6"', (1.0, 1.0, 1.5)),
        ('friction="2"', 1.0),
        ('friction="0.6" priority="1"', 1.0),
    ):
        ground = f'<geom type="plane" size="1 1 1" {plane}/>' if plane else ""
        text = f'<mujoco><compiler angle="radian"/><worldbody>{ground}{links}</worldbody></mujoco>'
        assert from_text(text).friction_factor == pytest.approx(expected)
    assert from_text(text, friction_factor=3.0).friction_factor == 3.0


def test_limits_that_the_file_disables_do_not_hold(from_text):
    limited = YAW.replace("/>", ' range="-0.5 0.5"/>')
    assert from_text(third(joints=limited)).joint_limit == (np.inf, 0.5)
    assert from_text(chain(body("c", limited), tail=OFF.format("limit"))).joint_limit == np.inf


def test_links_touch_each_other_where_any_two_do_in_the_file(from_text):
    ghost = 'contype="0" conaffinity="0"'
    for ghosts, self_contact in ((0, None), (1, None), (2, False), (3, False)):
        assert from_text(third().replace("size=", f"{ghost} size=", ghosts)).self_contact is self_contact
    parts = third().split("<geom ")
    named = parts[0] + "".join(f'<geom name="g{i}" {ghost} {part}' for i, part in enumerate(parts[1:]))
    pair = '<contact><pair geom1="g0" geom2="g2"/></contact></mujoco>'
    assert from_text(named).self_contact is False
    assert from_text(named.replace("</mujoco>", pair)).self_contact is None
    assert from_text(chain(body("c", PITCH), tail=OFF.format("contact"))).self_contact is False


def test_what_is_left_out_is_listed(from_text):
    """A swimmer: joints to the world in the plane, a fluid, motors with armature, a tendon."""
    root = '<joint name="x" type="slide" axis="1 0 0"/><joint name="turn" axis="0 0 1"/>'
    joints = '<joint name="p" axis="0 1 0" armature="0.1" stiffness="3" damping="{}"/>'
    tail = (
        '<contact><exclude body1="a" body2="c"/></contact>'
        '<option gravity="3 0 -4" density="1000" viscosity="0.1"/>'
        '<actuator><position joint="p"/></actuator><tendon><fixed name="t"><joint joint="p" coef="1"/></fixed></tendon>'
    )
    text = chain(body("c", joints.format(2).replace('"p"', '"q"')), joints.format(1), tail, root)
    with pytest.warns(UserWarning, match="left out") as caught:
        robot = from_text(text)
    assert (robot.gravity, robot.limp) == (5.0, (1,))
    assert robot.motor == Motor(rotor_inertia=0.1, gear_damping=1.0)
    assert [str(one.message) for one in caught] == [
        'snake.xml: left out joint "x", between the robot and the world; '
        'joint "turn", between the robot and the world; '
        'damping of joint "q" (2 N m s/rad); armature of joint "q" (0.1 kg m^2); '
        'stiffness of joint "p" and 1 more (3 N m/rad); '
        "the direction of option gravity (3 0 -4); 1 contact exclusions; "
        'option density (1000); option viscosity (0.1); tendon "t"'
    ]
    assert caught[0].filename == __file__


def test_actuators_have_armature_and_damping_too(from_text):
    joint = '<joint name="p" axis="0 1 0" armature="0.1" damping="{}" frictionloss="0.2"/>'
    tail = '<option><flag frictionloss="disable"/></option><actuator>{}{}</actuator>'
    motors = [f'<motor joint="{name}" gear="2" armature="0.05" damping="0.5"/>' for name in "pq"]
    text = chain(body("c", joint.format("1 3").replace('"p"', '"q"')), joint.format(1), tail.format(*motors))
    with pytest.warns(UserWarning, match=r'left out nonlinear damping of joint "q" \(3 at most\)$'):
        motor = from_text(text).motor
    assert motor.rotor_inertia == pytest.approx(0.1 + 4 * 0.05)
    assert (motor.gear_friction, motor.gear_damping) == (0.0, 1.0 + 4 * 0.5)
    with pytest.warns(UserWarning, match="left out damping .* armature"):
        assert from_text(text, backlash=0.1).motor is None


@pytest.mark.parametrize(
    "content", [None, "", "<mujoco>", "<robot>", "snake", "<mujoco><extension/><worldbody/>", b"\xff\0"]
)
def test_files_that_mujoco_cannot_read_are_refused(content, tmp_path):
    path = tmp_path / "snake.xml"
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    for file in (path, str(path), tmp_path, 5, None):
        with pytest.raises(ConfigError, match=r"path = .*: expected an MJCF or URDF file"):
            Robot.from_mjcf(file)


@pytest.mark.parametrize("tolerance", [-1.0, np.nan, "1", None])
def test_tolerances_that_are_none_are_refused(tolerance):
    with pytest.raises(ConfigError, match=r"tolerance = .*: expected a number in \[0, inf\]"):
        Robot.from_mjcf("snake.xml", tolerance=tolerance)
