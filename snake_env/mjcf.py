"""Robot, scene and controller as a model of MuJoCo, written as MJCF; MuJoCo itself is not needed."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from snake_env._native import simulate
from snake_env.config.motor import Motor
from snake_env.config.robot import LOCK_STIFFNESS, per_axis, per_link
from snake_env.errors import ConfigError
from snake_env.obstacles import (
    ROLLING_FRICTION,
    Box,
    Circle,
    Cylinder,
    HeightField,
    Movable,
    Obstacle,
    Polyhedron,
    Segment,
    Sphere,
    Vertical,
    centre,
    ground_friction,
    is_movable,
    outlines,
)

if TYPE_CHECKING:
    from snake_env.config.controllers import PD
    from snake_env.config.gait import Gait
    from snake_env.config.robot import Robot
    from snake_env.config.scene import Scene
    from snake_env.config.start import Start

Element = ElementTree.Element
Array = NDArray[np.float64]

HEIGHT = 2.0
"""Half height of the obstacles without end [m]; links do not come near their ends."""
LID = 5e-3
"""Thickness of the top faces, which have the ground's friction [m]."""
THICKNESS = 1e-3
"""Half thickness of segments, which have none in this package [m]."""
IMPRATIO, TOLERANCE, CONTACT_STEPS = 1e3, 1e-12, 7.0
"""Hardness of friction over that of the normal contact, tolerance of the solver, and time constant of contacts [steps].

Robots that friction holds hardly creep with them; contacts of a few steps rattle loose near the limit of friction."""
SOLID, LINK = "1", "2"
"""Collision types: links touch what is solid, and each other."""


def write(scene: Scene, robot: Robot, controller: PD, start: Start | None, gait: Gait, step: float) -> str:
    """The document; see :meth:`snake_env.Scene.to_mjcf`."""
    _require_supported(scene, robot, controller)
    place, orientation, posture = _pose(scene, robot, start, gait)
    root = Element("mujoco", model="snake_env")
    _add(root, "compiler", angle="radian")
    _add(
        root,
        "option",
        timestep=step,
        integrator="implicitfast",
        cone="elliptic",
        impratio=IMPRATIO,
        tolerance=TOLERANCE,
        gravity=_gravity(scene, robot),
    )
    assets = _add(root, "asset")
    world = _add(root, "worldbody")
    _add(world, "light", pos=(0.0, 0.0, 4.0))
    ground = {"condim": 3, "friction": (scene.friction[0], 0.0, 0.0), **_solid(step)}
    carriers: list[tuple[str, float | None]] = [("ground", None)]
    if _has_own_pairs(scene, robot):
        _add_ground_pairs(root, scene, robot, step)
    _add(world, "geom", name="ground", type="plane", size=(0.0, 0.0, 1.0), **ground)
    for j, obstacle in enumerate(scene.obstacles, start=1):
        name = f"obstacle_{j}"
        if is_movable(obstacle):
            continue
        friction = getattr(obstacle, "friction", 0.0)
        contact = {"condim": 3 if friction else 1, "friction": (friction, 0.0, 0.0), **_solid(step)}
        if isinstance(obstacle, HeightField | Polyhedron | Cylinder):
            carriers.append((name, friction))
        if isinstance(obstacle, HeightField):
            _add_field(world, assets, obstacle, name, ground if friction is None else contact)
            continue
        if isinstance(obstacle, Polyhedron):
            _add_hull(world, assets, np.array(obstacle.vertices), name, contact)
            continue
        if isinstance(obstacle, Cylinder):
            ends, radius = (*obstacle.start, *obstacle.end), float(obstacle.radius)
            _add(world, "geom", name=name, type="cylinder", fromto=ends, size=(radius,), **contact)
            continue
        height = obstacle.height if isinstance(obstacle, Vertical) else None
        _add_obstacle(world, assets, obstacle, name, (-HEIGHT, HEIGHT if height is None else height - LID), contact)
        if height is not None:
            _add_obstacle(world, assets, obstacle, f"{name}_top", (height - LID, height), ground)
            carriers.append((f"{name}_top", None))
    angles = posture.ravel().tolist()
    _add_chain(world, robot, place, angles, step)
    lying: list[float] = []
    for j, obstacle in enumerate(scene.obstacles, start=1):
        if isinstance(obstacle, Sphere):
            lying += _add_ball(root, obstacle, f"obstacle_{j}", carriers, step)
        elif is_movable(obstacle):
            lying += _add_movable(root, assets, obstacle, j, robot, step)
    actuators, references = _add(root, "actuator"), []
    servos = _servos(controller, robot)
    for (joint, axis), angle, servo in zip(robot.joint_axes, angles, servos, strict=True):
        if joint not in (*robot.locked, *robot.limp):
            name = _hinge(joint, axis)["name"]
            _add(actuators, "position", name=name, joint=name, **servo)
            references.append(angle)
    key = _add(_add(root, "keyframe"), "key", name="start", qpos=(*place, *orientation, *angles, *lying))
    key.set("ctrl", _text(tuple(references)))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode")


def _require_supported(scene: Scene, robot: Robot, controller: PD) -> None:
    """MuJoCo's frame of a contact turns with the capsule on a plane, but not on other geoms."""
    has_ground = any(
        (isinstance(obstacle, Vertical) and obstacle.height is not None)
        or (isinstance(obstacle, HeightField) and obstacle.friction is None)
        for obstacle in scene.obstacles
    )
    if has_ground and _has_own_pairs(scene, robot):
        equal = "equal coefficients where top faces or height fields have the friction of the ground, for MuJoCo"
        raise ConfigError("scene.friction", scene.friction, f"{equal}; and robot.friction_factor=1")
    if scene.friction[0] != scene.friction[1] and not per_link(robot.contact_half_length, robot.links).all():
        equal = "> 0 where friction along and across differ, for MuJoCo, where spheres have no direction"
        raise ConfigError("robot.contact_half_length", 0.0, equal)
    for j, obstacle in enumerate(scene.obstacles):
        _require_geom(obstacle, f"scene.obstacles[{j}]")
    if scene.friction_backward not in (None, scene.friction[0]):
        raise ConfigError(
            "scene.friction_backward", scene.friction_backward, "None for MuJoCo, whose friction is symmetric"
        )
    if scene.patches:
        raise ConfigError(
            "scene.patches", f"{len(scene.patches)} patches", "() for MuJoCo, whose plane has one friction"
        )
    if scene.stribeck.drop or any(scene.viscous):
        raise ConfigError("scene", "friction that depends on speed", "only Coulomb friction for MuJoCo")
    if any(math.isfinite(motor.no_load_speed) for motor in _motors(robot)):
        # At the call of Scene.to_mjcf.
        warnings.warn("left out: the torque-speed line of robot.motor", UserWarning, stacklevel=4)
    for field, value, expected in (
        ("robot.link_friction", robot.link_friction, 0.0),
        ("robot.backlash", max(per_axis(robot.backlash, robot)), 0.0),
        ("controller.active_from", controller.active_from, 0.0),
        ("controller.treatment", controller.treatment, "implicit"),
    ):
        if value != expected:
            raise ConfigError(field, repr(value), f"{expected!r} for MuJoCo")


def _require_geom(obstacle: Any, path: str) -> None:
    """MuJoCo has convex geoms, fields with one coefficient of friction, and a plane without end."""
    if isinstance(obstacle, Cylinder) and obstacle.inside:
        raise ConfigError(f"{path}.inside", True, "False for MuJoCo, which has no pipes")
    if isinstance(obstacle, HeightField):
        if np.ndim(obstacle.friction):  # type: ignore[arg-type]
            raise ConfigError(f"{path}.friction", "an array", "None or one number for MuJoCo")
        lowest = float(np.min(obstacle.height))
        if lowest < 0.0:
            expected = "all >= 0 for MuJoCo, whose plane z = 0 goes on below the field"
            raise ConfigError(f"{path}.height", f"a lowest height of {lowest:g}", expected)


def _gravity(scene: Scene, robot: Robot) -> tuple[float, float, float]:
    angle, direction = scene.slope
    down = robot.gravity * math.sin(angle)
    return -down * math.cos(direction), -down * math.sin(direction), -robot.gravity * math.cos(angle)


def _solid(step: float) -> dict[str, Any]:
    """Contacts with the ground and obstacles."""
    return {"contype": SOLID, "conaffinity": 0, "priority": 1, "solref": _solref(step)}


def _solref(step: float) -> tuple[float, float]:
    return CONTACT_STEPS * step, 1.0


def _has_own_pairs(scene: Scene, robot: Robot) -> bool:
    """Whether friction of the ground depends on direction or link."""
    return scene.friction[0] != scene.friction[1] or robot.friction_factor != 1.0


def _add_ground_pairs(root: Element, scene: Scene, robot: Robot, step: float) -> None:
    """Contacts of the ground with each link, with friction along and across it."""
    contacts = _add(root, "contact")
    for i, factor in enumerate(per_link(robot.friction_factor, robot.links), start=1):
        friction = (*(factor * mu for mu in scene.friction), 0.0, 0.0, 0.0)
        _add(contacts, "pair", geom1="ground", geom2=f"link_{i}", condim=3, friction=friction, solref=_solref(step))


def _add_obstacle(
    world: Element,
    assets: Element,
    obstacle: Any,
    name: str,
    between: tuple[float, float],
    contact: dict[str, Any],
) -> None:
    """The body over the outline of an obstacle ``between`` two heights [m]."""
    middle, half = 0.5 * (between[0] + between[1]), 0.5 * (between[1] - between[0])
    if not isinstance(obstacle, Obstacle) or isinstance(obstacle, Circle):
        values = (obstacle.radius, obstacle.x, obstacle.y) if isinstance(obstacle, Circle) else obstacle
        radius, x, y = (float(value) for value in values)
        _add(world, "geom", name=name, type="cylinder", size=(radius, half), pos=(x, y, middle), **contact)
        return
    corners = outlines([obstacle])[0]
    if isinstance(obstacle, Segment):
        along = corners[1] - corners[0]
        size = (0.5 * float(np.hypot(*along)), THICKNESS, half)
        place = (*corners.mean(axis=0), middle)
        turn = (0.0, 0.0, math.atan2(along[1], along[0]))
        _add(world, "geom", name=name, type="box", size=size, pos=place, euler=turn, **contact)
        return
    _add_hull(world, assets, np.array([(*corner, z) for z in between for corner in corners]), name, contact)


def _add_movable(
    root: Element, assets: Element, obstacle: Movable, j: int, robot: Robot, step: float
) -> tuple[float, ...]:
    """A body as high as the links, which touches them and obstacles without friction. Returns its position.

    It is free, or on two slides with springs; their stops are those of a square instead of a disc.
    """
    world, name = root.find("worldbody"), f"obstacle_{j}"
    assert world is not None
    half, mu = float(per_link(robot.radius, robot.links).max()), ground_friction(obstacle)
    place = (*centre(obstacle).tolist(), half)
    turn = 0.5 * obstacle.angle if isinstance(obstacle, Box) else 0.0
    body = _add(world, "body", name=name, pos=place, quat=(math.cos(turn), 0.0, 0.0, math.sin(turn)))
    if not isinstance(obstacle, Circle) or obstacle.stiffness is None:
        _add(body, "freejoint", name=name)
        at: tuple[float, ...] = (*place, math.cos(turn), 0.0, 0.0, math.sin(turn))
    else:
        held: dict[str, Any] = {"stiffness": obstacle.stiffness, "damping": obstacle.damping or 0.0}
        if obstacle.travel is not None:
            held |= {"range": (-obstacle.travel, obstacle.travel), "limited": "true", "solreflimit": _solref(step)}
        for axis, direction in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0))):
            _add(body, "joint", name=f"{name}_{axis}", type="slide", axis=direction, **held)
        at = (0.0, 0.0)
        if mu:
            _add(body, "joint", name=f"{name}_z", type="slide", axis=(0.0, 0.0, 1.0))
            at = (0.0, 0.0, 0.0)
    contact = _pushed(obstacle, step)
    if isinstance(obstacle, Circle):
        _add(body, "geom", name=name, type="cylinder", size=(obstacle.radius, half), **contact)
    elif isinstance(obstacle, Box):
        _add(body, "geom", name=name, type="box", size=(*(0.5 * np.array(obstacle.size)).tolist(), half), **contact)
    else:
        corners = outlines([obstacle])[0] - centre(obstacle)
        _add_hull(body, assets, np.array([(*corner, z) for z in (-half, half) for corner in corners]), name, contact)
    friction = (mu, mu, 0.0, 0.0, 0.0)
    _add(_contacts(root), "pair", geom1="ground", geom2=name, condim=3, friction=friction, solref=_solref(step))
    return at


def _add_ball(
    root: Element, ball: Sphere, name: str, carriers: Sequence[tuple[str, float | None]], step: float
) -> tuple[float, ...]:
    """A free sphere, which touches links without friction and rolls on the ``carriers``. Returns its position.

    These are geoms with their friction, None: that of the ground. In MuJoCo the coefficients of rolling friction and of
    friction against spin are lengths.
    """
    world = root.find("worldbody")
    assert world is not None
    place = (ball.x, ball.y, ball.height)
    body = _add(world, "body", name=name, pos=place)
    _add(body, "freejoint", name=name)
    _add(body, "geom", name=name, type="sphere", size=(ball.radius,), **_pushed(ball, step))
    rolling = ball.radius * (ROLLING_FRICTION if ball.rolling_friction is None else ball.rolling_friction)
    for carrier, own in carriers:
        mu = ground_friction(ball) if own is None else own
        pair = {"condim": 6, "friction": (mu, mu, rolling, rolling, rolling), "solref": _solref(step)}
        _add(_contacts(root), "pair", geom1=carrier, geom2=name, **pair)
    return (*place, 1.0, 0.0, 0.0, 0.0)


def _pushed(obstacle: Movable, step: float) -> dict[str, Any]:
    """Contacts of what can be pushed, with the friction of what is fixed."""
    smooth = {"conaffinity": SOLID, "condim": 1, "friction": (0.0, 0.0, 0.0)}
    return {**_solid(step), **smooth, "mass": obstacle.mass}


def _contacts(root: Element) -> Element:
    """The list of explicit pairs."""
    found = root.find("contact")
    return _add(root, "contact") if found is None else found


def _add_hull(world: Element, assets: Element, vertices: Array, name: str, contact: dict[str, Any]) -> None:
    """A mesh, which touches links with its convex hull."""
    _add(assets, "mesh", name=name, vertex=tuple(vertices.ravel().tolist()))
    _add(world, "geom", name=name, type="mesh", mesh=name, **contact)


def _add_field(world: Element, assets: Element, field: HeightField, name: str, contact: dict[str, Any]) -> None:
    """Heights above the lowest one, in rows along x from the greatest y to the least; MuJoCo scales them to 0 to 1."""
    height, half = np.array(field.height, np.float64), 0.5 * field.spacing
    low, high = float(height.min()), float(height.max())
    sides = [half * (count - 1) for count in height.shape]
    rows = tuple(height.T[::-1].ravel().tolist())
    size = (*sides, high - low if high > low else 1.0, HEIGHT)
    _add(assets, "hfield", name=name, nrow=height.shape[1], ncol=height.shape[0], elevation=rows, size=size)
    middle = (field.origin[0] + sides[0], field.origin[1] + sides[1], low)
    _add(world, "geom", name=name, type="hfield", hfield=name, pos=middle, **contact)


def _add_chain(world: Element, robot: Robot, place: tuple[float, ...], angles: list[float], step: float) -> None:
    """Nested bodies, x along the links and z up, with the origin at the CG of link 1 and at the joints."""
    count = robot.links
    length, half, radius, mass, offset, inertia, roll = (
        per_link(value, count)
        for value in (
            robot.length,
            robot.contact_half_length,
            robot.radius,
            robot.mass,
            robot.cg_offset,
            robot.inertia,
            robot.roll_inertia,
        )
    )
    # Links touch what is solid by their conaffinity, and each other by their contype; neighbours do not.
    contact = {"contype": 0 if robot.self_contact is False else LINK, "conaffinity": 3, "condim": 1}
    body, motors = world, _motors(robot)
    for i in range(count):
        at = place if i == 0 else (0.5 * length[0] + offset[0] if i == 1 else length[i - 1], 0.0, 0.0)
        body = _add(body, "body", name=f"link_{i + 1}", pos=at)
        if i == 0:
            _add(body, "freejoint", name="root")
        else:
            limit = _limit(robot, i - 1)
            for (joint, axis), angle, motor in zip(robot.joint_axes, angles, motors, strict=True):
                if joint == i - 1:
                    driven = {} if joint in robot.limp else _rotor(motor, step)
                    own = _lock(angle, step) if joint in robot.locked else driven
                    _add(body, "joint", **_hinge(joint, axis), type="hinge", **limit, **own)
        cg = 0.0 if i == 0 else 0.5 * length[i] - offset[i]
        _add(body, "inertial", pos=(cg, 0.0, 0.0), mass=mass[i], diaginertia=(roll[i], inertia[i], inertia[i]))
        middle = cg + offset[i]
        # MuJoCo refuses capsules without straight sides.
        shape: dict[str, Any] = {"type": "sphere", "pos": (middle, 0.0, 0.0)}
        if half[i]:
            shape = {"type": "capsule", "fromto": (middle - half[i], 0.0, 0.0, middle + half[i], 0.0, 0.0)}
        _add(body, "geom", name=f"link_{i + 1}", size=(radius[i],), **shape, **contact)


def _lock(angle: float, step: float) -> dict[str, Any]:
    """A spring whose damping, which MuJoCo takes at the end of the step, puts it there too: K q + h K q'."""
    return {"stiffness": LOCK_STIFFNESS, "springref": angle, "damping": LOCK_STIFFNESS * step}


def _motors(robot: Robot) -> list[Motor]:
    """Of each axis; ``Motor()``, which does nothing, where a robot has none."""
    return per_axis(Motor() if robot.motor is None else robot.motor, robot)


def _rotor(motor: Motor, step: float) -> dict[str, Any]:
    """Inertia of the motor of an axis, and friction of its gear, as stiff as the time step lets it be."""
    if not (motor.rotor_inertia or motor.gear_friction or motor.gear_damping):
        return {}
    return {
        "armature": motor.rotor_inertia * motor.gear_ratio**2,
        "frictionloss": motor.gear_friction,
        "damping": motor.gear_damping,
        "solreffriction": (2.0 * step, 1.0),
        "solimpfriction": (0.9999, 0.9999),
    }


def _limit(robot: Robot, joint: int) -> dict[str, Any]:
    """Limits of a joint, which the spatial model has to both sides or to none."""
    given = robot.joint_limit
    one: Any = math.pi / 2 if given is None else given[joint] if isinstance(given, Sequence) else given
    bounds = one if isinstance(one, Sequence) else (-one, one)
    if all(map(math.isinf, bounds)):
        return {}
    return {"range": tuple(bounds), "limited": "true"}


_DIRECTIONS = {"yaw": (0, 0, 1), "pitch": (0, 1, 0), "roll": (1, 0, 0)}


def _hinge(joint: int, axis: Any) -> dict[str, Any]:
    """Name and direction of an axis of a joint; components of vectors are those in the link frame of this package."""
    if isinstance(axis, str):
        return {"name": f"{axis}_{joint + 1}", "axis": _DIRECTIONS[axis]}
    return {"name": f"axis_{joint + 1}", "axis": (axis[2], axis[0], axis[1])}


def _servos(controller: PD, robot: Robot) -> Iterator[dict[str, Any]]:
    """Of each axis: its own gains and limit, or the controller's."""
    unlimited = math.inf if controller.torque_limit is None else controller.torque_limit
    shared = {"kp": controller.kp, "kd": controller.kd, "torque_limit": unlimited}
    own = {name: getattr(robot, name) for name in shared}
    columns = [per_axis(shared[name] if value is None else value, robot) for name, value in own.items()]
    for motor, kp, kd, own_limit in zip(_motors(robot), *columns, strict=True):
        limit = min(motor.stall_torque, own_limit)
        bounds = {} if math.isinf(limit) else {"forcerange": (-limit, limit), "forcelimited": "true"}
        yield {"kp": kp, "kv": kd, **bounds}


def _pose(
    scene: Scene, robot: Robot, start: Start | None, gait: Gait
) -> tuple[tuple[float, ...], tuple[float, ...], Array]:
    """CG and quaternion of link 1, for the chain written here, and the angles of the joints."""
    given = {} if start is None else {"start": start}
    fixed = dataclasses.replace(scene, obstacles=[one for one in scene.obstacles if not is_movable(one)])
    run = {"model": "spatial", "robot": robot, "scene": fixed, "gait": gait, "duration": 1e-6, "sample": 1e-6}
    begin = {name: np.asarray(value)[0] for name, value in simulate(run | given).items() if name in _POSE}
    return tuple(begin["position"][0]), tuple(_FROM_BODY_AXES @ begin["quaternion"][0]), begin["joint_angle"]


_POSE = ("position", "quaternion", "joint_angle")
_FROM_BODY_AXES = 0.5 * np.array([[1, 1, 1, 1], [-1, 1, -1, 1], [-1, 1, 1, -1], [-1, -1, 1, 1]])
"""The body axes, z along the centre line and y up, turned to x along it and z up."""


def _add(parent: Element, tag: str, /, **attributes: Any) -> Element:
    return ElementTree.SubElement(parent, tag, {key: _text(value) for key, value in attributes.items()})


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(_text(one) for one in value)
    return repr(float(value)) if isinstance(value, float | np.floating) else str(value)
