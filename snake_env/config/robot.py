"""The chain of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from snake_env.config.motor import Motor
from snake_env.config.section import DEGREE, Section, core_defaults, deprecated_alias

PerLink = float | Sequence[float]
PerAxis = float | Sequence[float | Sequence[float]]
AxisName = Literal["both", "yaw", "pitch", "roll"]

_AIKO = core_defaults("robot")

LOCK_STIFFNESS = 1e9
"""Of the springs in locked joints [N m/rad]."""


@deprecated_alias("free_play", "backlash")
@dataclass(frozen=True)
class Robot(Section):
    """A chain of rigid links; the default is Aiko (T Table 7.1).

    Lengths, masses, inertias and ``friction_factor`` are a number for all links or a sequence, one per link. Backlash,
    gains and torque limit are a number for all joints or a sequence, one per joint. There a joint with both axes may
    have (yaw, pitch).

    Args:
        links: number of links n >= 2.
        length: distance between adjacent joints L_i [m], > 0.
        contact_half_length: half length of the straight sides of a link's outline L_GS,i [m], >= 0.
        radius: half width of a link and radius of its round ends L_SC,i [m], > 0.
        mass: m_i [kg], > 0.
        cg_offset: how far the CG lies in front of the middle of the link, towards the head [m], less than half of the
            length. Positions of links are those of their CGs, with or without it. With the method "implicit" only, not
            in the minimal model.
        inertia: moment of inertia about an axis across the link through the CG, Theta_psi [kg m^2], > 0.
        roll_inertia: moment of inertia about the link's centre line, Theta_rho [kg m^2], > 0; the spatial model only.
        gravity: acceleration of gravity [m/s^2], > 0.
        self_contact: whether links that are not neighbours touch each other, or pass through each other as in the
            thesis. None: True in the planar and the spatial model with the method "implicit".
        link_friction: coefficient of Coulomb friction between such links, >= 0; the planar model with the method
            "implicit" only.
        joint_limit: largest angle of a joint to either side [rad], > 0, ``inf`` for none. None: a right angle in the
            planar and the spatial model with the method "implicit", none elsewhere. Or a sequence, one per joint, of
            such numbers or (lower, upper) with lower <= 0 <= upper. In the spatial model it limits yaw and pitch. There
            it is at most 3.13 to both sides, or ``inf`` to both.
        axes: about which axes the joints turn in the spatial model, fixed in the frames of both links: a name for all,
            or one per joint. Names are "yaw", "pitch", "both" (a cardan joint, yaw before pitch) and "roll"
            (about the centre line). A vector (x, y, z) of the link frame, of any length, is an axis too. There x is
            that of pitch, y that of yaw, and z points to the next link. A joint has one axis, or two as "both". About
            an axis that it does not have it is rigid. Unless ``axes`` is "both", joint angles, rates and torques are
            listed axis by axis, as :attr:`joint_axes` has them. Vertical waves drive pitch and axes that are nearer to
            it than to yaw and roll. Horizontal ones drive yaw and other oblique axes. Axes that point along the link
            more than across are moved by joint angles only. The planar and the minimal model take joints with yaw. With
            the method "implicit" only.
        backlash: angle by which a joint can turn while its motor stands still (T 7.5.4) [rad], 0 to pi/2; Aiko has 3
            to 5 degrees. Per joint. Not in the minimal model, with the method "thesis" nor with :class:`IOLinearizing`.
        motor: what drives every axis that is neither locked nor limp; None: whatever torque the controller asks for, at
            any rate. Or a sequence, one per joint, where a joint with both axes may have (yaw, pitch). ``Motor()``
            stands for none there. With the method "implicit" only, not in the minimal model.
        locked: joints that keep the angle of the start, numbered from 0 as in ``joint_angle``. Springs of 1e9 N m/rad
            hold them, without play, torque limit or drift. With the method "implicit", set-valued friction and
            :class:`PD` only. In environments actions do not move them.
        limp: joints without an actuator, numbered likewise; the same holds.
        kp: k_P of the joints [N m/rad], >= 0, in place of that of the controller; None: the controller's. This and the
            next two need the method "implicit" and :class:`PD`, not in the minimal model. Environments whose actions
            are torques take None.
        kd: k_D likewise [N m s/rad], >= 0.
        torque_limit: largest torque likewise [N m], > 0, ``inf`` for none.
        friction_factor: per link, on the coefficients of the plane ground's friction along, across and against spin,
            >= 0: a skin of its own. Rolling friction, patches and other bodies keep theirs. With the method "implicit"
            and :class:`PD` only, not in the minimal model.
    """

    _section = "robot"
    _parts = MappingProxyType({"motor": Motor})
    _listed = frozenset({"motor"})

    links: int = _AIKO.links
    length: PerLink = _AIKO.length
    contact_half_length: PerLink = _AIKO.contact_half_length
    radius: PerLink = _AIKO.radius
    mass: PerLink = _AIKO.mass
    cg_offset: PerLink = _AIKO.cg_offset
    inertia: PerLink = _AIKO.inertia
    roll_inertia: PerLink = _AIKO.roll_inertia
    gravity: float = _AIKO.gravity
    backlash: PerAxis = _AIKO.backlash
    self_contact: bool | None = _AIKO.self_contact
    link_friction: float = _AIKO.link_friction
    joint_limit: float | Sequence[float | Sequence[float]] | None = _AIKO.joint_limit
    axes: AxisName | Sequence[AxisName | Sequence[float]] = _AIKO.axes
    motor: Motor | Sequence[Motor | Sequence[Motor]] | None = _AIKO.motor
    locked: Sequence[int] = _AIKO.locked
    limp: Sequence[int] = _AIKO.limp
    kp: PerAxis | None = _AIKO.kp
    kd: PerAxis | None = _AIKO.kd
    torque_limit: PerAxis | None = _AIKO.torque_limit
    friction_factor: PerLink = _AIKO.friction_factor

    @property
    def joint_axes(self) -> list[tuple[int, AxisName | tuple[float, ...]]]:
        """Joint, numbered from 0, and axis of each column of joint angles where ``axes`` is not "both"."""
        entries = [self.axes] * (self.links - 1) if isinstance(self.axes, str) else self.axes
        pairs: list[tuple[int, Any]] = []
        for joint, entry in enumerate(entries):
            if not isinstance(entry, str):
                unit = tuple(float(part) for part in np.divide(entry, np.linalg.norm(entry)))
                entry = UNIT_AXES.get(unit, entry)
            names = ("yaw", "pitch") if isinstance(entry, str) and entry == "both" else (entry,)
            pairs += [(joint, name) for name in names]
        return pairs

    @property
    def twisting(self) -> list[int]:
        """Joints that waves pass by: their axes point along the link more than across."""

        def twists(axis: Any) -> bool:
            return axis == "roll" if isinstance(axis, str) else abs(axis[2]) > max(abs(axis[0]), abs(axis[1]))

        return [joint for joint, axis in self.joint_axes if twists(axis)]

    @classmethod
    def aiko(cls, **changes: Any) -> Robot:
        """Aiko as it was built: (T Table 7.1) and joints with 4 degrees of backlash (T 7.5.4); keywords replace these.

        Not in the minimal model. Its 10 references per second are ``simulate(reference_rate=10)``, its controllers
        :meth:`PD.aiko`, its motors :meth:`Motor.aiko`.
        """
        return cls(**({"backlash": 4 * DEGREE} | changes))

    @classmethod
    def sea_snake(cls, **changes: Any) -> Robot:
        """The SEA Snake of Carnegie Mellon University, 16 modules with one hinge each, in turn yaw and pitch.

        From its data sheet as listed at wevolver.com/specs/sea.snake. A module has diameter 5.1 cm, length 6.4 cm and
        mass 205 g, and turns by a right angle to either side. The robot has 1.174 m and 3.657 kg. Assumed: what these
        leave for the two ends is shared equally, and links are homogeneous cylinders. The springs in its joints are not
        modelled; these give 7 N m: ``PD(..., torque_limit=7.0)``. Keywords replace fields.
        """
        modules, radius = 15, 0.0255
        length = np.array([0.107, *[0.064] * modules, 0.107])
        mass = np.array([0.291, *[0.205] * modules, 0.291])
        return cls(**(_cylinders(length, radius, mass) | {"axes": ["yaw", "pitch"] * 8} | changes))

    @classmethod
    def dgist(cls, **changes: Any) -> Robot:
        """A robot with 20 hinges, in turn pitch and yaw, as public models of DGIST's snake robot have it.

        From Snake_Robot_o20_Rolling_S.xml in github.com/XiaoJian923/Snake_Robot_Gait, commit 6d217ea. Joints are 67.5
        and 69.5 mm apart and turn by a right angle to either side. A module has 0.2 kg, a joint has an armature of 0.01
        kg m^2 and damping of 0.6 N m s/rad. Its servos are ``PD(4.0, 0.0, torque_limit=3.0)``. The radius of 32.5 mm is
        that of the discs in description/mujoco/snake_dgist.xml of github.com/VanguardDream/snake_RL. Assumed: head and
        tail are as long as modules, and links are homogeneous cylinders. These are data of models; no data sheet is
        published. Keywords replace fields.
        """
        radius, mass = 0.0325, 0.2
        length = np.array([0.0695, *[0.0675, 0.0695] * 10])
        joints = {"axes": ["pitch", "yaw"] * 10, "motor": Motor(rotor_inertia=0.01, gear_damping=0.6)}
        return cls(**(_cylinders(length, radius, mass) | joints | changes))

    @classmethod
    def from_mjcf(cls, path: str | Path, *, tolerance: float = 1e-6, **changes: Any) -> Robot:
        """The serial chain of links and hinges in a file of MuJoCo, which has to be installed (extra ``mujoco``).

        Links are numbered from the root of the file on; a chain that is fixed to the world comes loose. Bodies without
        joints belong to the link that carries them. Joint angles are zero in the file's initial configuration, in which
        the robot has to be straight. There y of the link frames is up: as near to the z axis of the world as the links
        let it be. Where they stand upright it is the x axis of the world. Two hinges in one point, yaw before pitch,
        are a cardan joint. Hinges that turn the other way round than yaw and pitch are vectors, which waves bend the
        other way. ``axes`` may name them, with angles of opposite sign. Radius and contact half length are those of the
        capsule around what collides of a link: one capsule, cylinder or sphere. It has to be around the middle of the
        link, and the length of a link at an end is such that it is. With both of these given the CG of such a link is
        in the middle. With ``length`` given all CGs are taken to be there. ``self_contact`` is False where no two links
        can collide. Joints that no actuator drives are limp, unless none is driven; those with springs of 1e9 N m/rad,
        as :meth:`Scene.to_mjcf` writes them, are locked.

        Gains of servos and torque limits that differ from joint to joint are read. Those that are the same at all
        joints belong to :class:`PD`, the friction of the ground to :class:`Scene`; neither is read. Where coefficients
        of sliding between links and ground differ, ``friction_factor`` has their ratios. There the link in the middle
        of their order has 1, and its coefficient belongs to :class:`Scene`. Armature, friction and damping of
        driven joints are those of the ``motor``.

        Args:
            path: of the file; what :meth:`Scene.to_mjcf` writes is one.
            tolerance: how far joints, CGs and outlines may lie off the centre line [m], >= 0. So far may CGs lie off
                the middle of their links without a ``cg_offset``. They are taken to lie there.
            changes: fields in place of those in the file, which then need not fit the model.

        Raises:
            ConfigError: names file, body and element, the value, and what a robot can have.

        Warns:
            UserWarning: lists what is left out, such as springs at the joints.
        """
        return cls(**_from_file(path, tolerance, changes))

    @classmethod
    def from_urdf(cls, path: str | Path, *, tolerance: float = 1e-6, **changes: Any) -> Robot:
        """The serial chain in a URDF file; as :meth:`from_mjcf`. The root link is link 1 if it has mass."""
        return cls(**_from_file(path, tolerance, changes))


def _from_file(path: str | Path, tolerance: float, changes: dict[str, Any]) -> dict[str, Any]:
    """Fields in a file, and changes in their place."""
    from snake_env.config import robot_file

    return robot_file.read(path, tolerance, changes) | changes


UNIT_AXES: dict[tuple[float, ...], AxisName] = {
    (0.0, 1.0, 0.0): "yaw",
    (1.0, 0.0, 0.0): "pitch",
    (0.0, 0.0, 1.0): "roll",
}
"""Names of vectors of the link frame."""


def _cylinders(length: NDArray[np.float64], radius: float, mass: float | NDArray[np.float64]) -> dict[str, Any]:
    """Fields of links (n,) that are homogeneous cylinders with round ends to touch [m], [kg]."""
    return {
        "links": len(length),
        "length": length,
        "contact_half_length": 0.5 * length - radius,
        "radius": radius,
        "mass": mass,
        "inertia": mass * (3.0 * radius**2 + length**2) / 12.0,
        "roll_inertia": 0.5 * mass * radius**2,
    }


V = TypeVar("V")


def per_axis(value: V | Sequence[V | Sequence[V]], robot: Robot) -> list[V]:
    """A quantity of each axis in :attr:`Robot.joint_axes`."""
    joints: Any = value if isinstance(value, Sequence) else [value] * (robot.links - 1)
    second = {(joint, "pitch") for joint, axis in robot.joint_axes if axis == "yaw"}
    pairs = ((joints[joint], (joint, axis) in second) for joint, axis in robot.joint_axes)
    return [one[is_second] if isinstance(one, Sequence) else one for one, is_second in pairs]


def per_link(value: PerLink, links: int) -> NDArray[np.float64]:
    """A quantity of each link (links,)."""
    return np.broadcast_to(np.asarray(value, np.float64), (links,))
