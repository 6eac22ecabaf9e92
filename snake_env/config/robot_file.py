"""Robots as files in MJCF or URDF, which MuJoCo reads: the chain, its links, and what is left out."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from snake_env import _checks
from snake_env._documents import reading, require_size
from snake_env._extras import extras
from snake_env.config.robot import UNIT_AXES
from snake_env.config.robot_file_joints import Actuation
from snake_env.errors import ConfigError

Array = NDArray[np.float64]

ROUNDED = 1e-4
"""Deviation of directions [rad], and relative one of inertias, in files that write right angles as 1.5708."""

POINT = 1e-6
"""Distance of joints that are in one point [m]."""

LARGEST_LIMIT = 3.13
"""Of joints in the spatial model [rad], whose angles lie in (-pi, pi]."""


def read(path: str | Path, tolerance: float, given: Collection[str]) -> dict[str, Any]:
    """Fields of the robot in a file, without those ``given``; for :meth:`snake_env.Robot.from_mjcf`."""
    return _Chain(path, _checks.number("tolerance", tolerance, 0.0)).fields(given)


@dataclass
class _Link:
    """Bodies that are one rigid link, the one with its name first, and the hinges between it and the link before."""

    bodies: list[int]
    hinges: list[int]


class _Chain:
    """A model of MuJoCo in its initial configuration, and the serial chain in it.

    ``frame`` has the link frame of the straight robot in its rows: x across, y up, z along the links.
    """

    def __init__(self, path: str | Path, tolerance: float) -> None:
        with extras():
            import mujoco
        self.library = mujoco
        with reading("path", path, "an MJCF or URDF file of a model that MuJoCo compiles"):
            require_size(Path(path))
            spec = mujoco.MjSpec.from_file(str(path))
            # Bodies without joints are merged here, as MuJoCo would drop the root link of a URDF file.
            spec.compiler.fusestatic = False
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # about its own simulation of the model
                self.model = spec.compile()
        self.path, self.file, self.tolerance = path, Path(path).name, tolerance
        self._require_rigid_bodies()
        self._place_bodies()
        self.supports: list[int] = []
        self.links = self._merge_cardans(self._links())
        if len(self.links) < 2:
            raise ConfigError(self.file, "one link", "a chain of at least two links")
        self.hinges = [hinge for link in self.links for hinge in link.hinges]
        self.actuation = Actuation(mujoco, self.model, [link.hinges for link in self.links[1:]])
        self.masses = [self._mass(link.bodies) for link in self.links]
        self._find_line()

    def fields(self, given: Collection[str]) -> dict[str, Any]:
        found: dict[str, Any] = {"links": len(self.links), "mass": _same([mass for mass, _, _ in self.masses])}
        takes_outlines = not {"radius", "contact_half_length"} <= set(given)
        self.middles = [self._local(cg)[2] for _, cg, _ in self.masses]
        if "length" not in given:
            found["length"], offsets = self._lengths(takes_outlines)
            if any(offsets):
                found["cg_offset"] = _same(offsets)
        if not {"inertia", "roll_inertia"} <= set(given):
            across, along = zip(*map(self._inertias, range(len(self.links))), strict=True)
            found |= {"inertia": _same(across), "roll_inertia": _same(along)}
        if takes_outlines:
            radius, half = zip(*map(self._outline, range(len(self.links))), strict=True)
            found |= {"radius": _same(radius), "contact_half_length": _same(half)}
        if "axes" not in given:
            found["axes"] = _same([self._axes(link) for link in self.links[1:]])
        if "joint_limit" not in given:
            found["joint_limit"] = _same([self._limit(link) for link in self.links[1:]])
        if "locked" not in given:
            found["locked"] = self.actuation.locked
        if "limp" not in given:
            found["limp"] = self.actuation.limp
        self.takes_motor = not {"motor", "backlash"} & set(given)
        if self.takes_motor:
            found |= self.actuation.motors()
        found |= self.actuation.gains()
        if takes_outlines and "friction_factor" not in given:
            found |= self.actuation.friction([self._geom(i)[0] for i in range(len(self.links))])
        if "gravity" not in given:
            found["gravity"] = (
                0.0 if self.actuation.is_off("GRAVITY") else float(np.linalg.norm(self.model.opt.gravity))
            )
            if not found["gravity"]:
                raise ConfigError(f"{self.file}, option gravity", 0.0, "a vector other than zero, or gravity= [m/s^2]")
        bodies = [body for link in self.links for body in link.bodies]
        if np.isin(self.model.geom_bodyid, bodies).any() and not self._links_collide():
            found["self_contact"] = False
        if left_out := list(self._left_out(bodies)):
            # At the call of Robot.from_mjcf.
            warnings.warn(f"{self.file}: left out " + "; ".join(left_out), UserWarning, stacklevel=5)
        return {name: value for name, value in found.items() if name not in given}

    @cached_property
    def revolute(self) -> set[str | None]:
        """Names of joints with limits in a URDF file; MuJoCo does not keep the type, and ignores equal limits."""
        with reading("path", self.path, "well-formed XML"), open(self.path, "rb") as file:
            if next(ElementTree.iterparse(file, ("start",)))[1].tag != "robot":
                return set()
            file.seek(0)
            joints = ElementTree.parse(file).getroot().findall("joint")
        return {joint.get("name") for joint in joints if joint.get("type") == "revolute"}

    def _links_collide(self) -> bool:
        """Whether any two links can, as MuJoCo decides it for their geoms."""
        model = self.model
        owner = np.full(model.nbody, -1)  # the last of those below, for bodies of no link
        for i, link in enumerate(self.links):
            owner[link.bodies] = i
        types, affinities = np.zeros((2, len(self.links) + 1), np.int32)
        np.bitwise_or.at(types, owner[model.geom_bodyid], model.geom_contype)
        np.bitwise_or.at(affinities, owner[model.geom_bodyid], model.geom_conaffinity)
        meet = types[:-1, None] & affinities[:-1]
        np.fill_diagonal(meet, 0)
        first, second = (owner[model.geom_bodyid[geoms]] for geoms in (model.pair_geom1, model.pair_geom2))
        paired = (first >= 0) & (second >= 0) & (first != second)
        return not self.actuation.is_off("CONTACT") and bool(meet.any() or paired.any())

    def _name(self, kind: str, number: int) -> str:
        name = self.library.mj_id2name(self.model, getattr(self.library.mjtObj, f"mjOBJ_{kind.upper()}"), number)
        return f'{kind} "{name}"' if name else f"{kind} {number} (without a name)"

    def _error(self, kind: str, number: int, value: Any, expected: str) -> ConfigError:
        """Names a body, or a joint or geom and its body."""
        model = self.model
        body = number if kind == "body" else {"joint": model.jnt_bodyid, "geom": model.geom_bodyid}[kind][number]
        element = "" if kind == "body" else f", {self._name(kind, number)}"
        return ConfigError(f"{self.file}, {self._name('body', body)}{element}", value, expected)

    def _require_rigid_bodies(self) -> None:
        model = self.model
        for kind, count in (("equality", model.neq), ("plugin", model.nplugin), ("flex", model.nflex)):
            if count:
                raise ConfigError(f"{self.file}, {self._name(kind, 0)}", f"{count} in all", "links and hinges only")

    def _place_bodies(self) -> None:
        """Origins and axes of the bodies where all joints have the file's initial values."""
        model = self.model
        self.origin, self.turn = np.zeros((model.nbody, 3)), np.tile(np.eye(3), (model.nbody, 1, 1))
        for body in range(1, model.nbody):
            parent = model.body_parentid[body]
            self.origin[body] = self.origin[parent] + self.turn[parent] @ model.body_pos[body]
            self.turn[body] = self.turn[parent] @ self._matrix(model.body_quat[body])
        owner = model.jnt_bodyid
        self.anchor = self.origin[owner] + np.einsum("jab,jb->ja", self.turn[owner], model.jnt_pos)
        self.axis = np.einsum("jab,jb->ja", self.turn[owner], model.jnt_axis)

    def _matrix(self, quaternion: Array) -> Array:
        matrix = np.empty(9)
        self.library.mju_quat2Mat(matrix, quaternion)
        return matrix.reshape(3, 3)

    def _links(self) -> list[_Link]:
        """From the root on. A link is a body with joints and the bodies without that are fixed to it.

        The first one is the body that is fixed to the world, if it has mass, or else the first that moves.
        """
        model, weld = self.model, self.model.body_weldid
        moving = [body for body in range(1, model.nbody) if weld[body] == body]
        before = {body: int(weld[model.body_parentid[body]]) for body in moving}
        body = self._only([body for body in moving if before[body] == 0], 0)
        fixed = np.flatnonzero((weld == 0) & (model.body_rootid == model.body_rootid[body])).tolist()
        links = [_Link(fixed, [])] if model.body_mass[fixed].sum() > 0.0 else []
        while True:
            joints = np.flatnonzero(model.jnt_bodyid == body).tolist()
            if not links:
                self.supports, joints = [j for j in joints if model.jnt_type[j] != self.library.mjtJoint.mjJNT_FREE], []
            for joint in joints:
                if model.jnt_type[joint] != self.library.mjtJoint.mjJNT_HINGE:
                    kind = self.library.mjtJoint(model.jnt_type[joint]).name.removeprefix("mjJNT_").lower()
                    raise self._error("joint", joint, kind, "a hinge")
            links.append(_Link(np.flatnonzero(weld == body).tolist(), joints))
            following = [child for child in moving if before[child] == body]
            if not following:
                return links
            body = self._only(following, body)

    def _only(self, following: list[int], body: int) -> int:
        """The one body that follows in a serial chain."""
        if len(following) != 1:
            names = " and ".join(self._name("body", child) for child in following[:3])
            expected = "one body that moves relative to it, and one chain in the file"
            raise self._error("body", body, names or "no body that moves", expected)
        return following[0]

    def _merge_cardans(self, links: list[_Link]) -> list[_Link]:
        """A body between two joints in one point, the cross of a cardan joint, is part of the link behind it."""
        self.crosses: list[int] = []
        merged = links[:1]
        for link in links[1:]:
            front = merged[-1]
            ends = self.anchor[front.hinges[-1:] + link.hinges[:1]]
            if front.hinges and np.linalg.norm(ends[-1] - ends[0]) < POINT:
                self.crosses += front.bodies
                merged[-1] = _Link(link.bodies + front.bodies, front.hinges + link.hinges)
            else:
                merged.append(link)
        return merged

    def _mass(self, bodies: list[int]) -> tuple[float, Array, Array]:
        """Mass, CG, and inertia about it in the axes of the world."""
        model = self.model
        mass = model.body_mass[bodies]
        centre = self.origin[bodies] + np.einsum("bij,bj->bi", self.turn[bodies], model.body_ipos[bodies])
        cg = mass @ centre / mass.sum()
        inertia = np.zeros((3, 3))
        for body, m, offset in zip(bodies, mass, centre - cg, strict=True):
            turn = self.turn[body] @ self._matrix(model.body_iquat[body])
            inertia += turn * model.body_inertia[body] @ turn.T
            inertia += m * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        return float(mass.sum()), cg, inertia

    def _find_line(self) -> None:
        """The centre line, through all joints, or with one joint through the CGs; requires a straight robot."""
        cg = np.array([cg for _, cg, _ in self.masses])
        hinges = [link.hinges[0] for link in self.links[1:]]
        ends = self.anchor[[hinges[0], hinges[-1]]] if len(hinges) > 1 else cg[[0, -1]]
        self.start, along = self.anchor[hinges[0]], ends[1] - ends[0]
        if not np.linalg.norm(along) > 0.0:
            raise self._error("joint", hinges[0], "on a line of length 0", "joints or CGs behind one another")
        z = along / np.linalg.norm(along)
        # A robot that stands upright has x of the world up.
        upright = np.linalg.norm(np.cross(z, (0.0, 0.0, 1.0))) < ROUNDED
        y = np.array((1.0, 0.0, 0.0) if upright else (0.0, 0.0, 1.0))
        y -= y @ z * z
        y /= np.linalg.norm(y)
        self.frame = np.stack([np.cross(y, z), y, z])
        for link in self.links[1:]:
            for hinge in link.hinges:
                away = np.hypot(*self._local(self.anchor[hinge])[:2])
                if away > self.tolerance:
                    expected = f"at most {self.tolerance:g} m, so that the robot is straight, or a larger tolerance="
                    raise self._error("joint", hinge, f"{away:g} m off the line", expected)
        for link, (_, centre, _) in zip(self.links, self.masses, strict=True):
            away = np.hypot(*self._local(centre)[:2])
            if away > self.tolerance:
                expected = f"at most {self.tolerance:g} m, or a larger tolerance="
                raise self._error("body", link.bodies[0], f"CG {away:g} m off the line", expected)

    def _local(self, point: Array) -> Array:
        """In the link frame, with the origin in the first joint."""
        return self.frame @ (point - self.start)

    def _lengths(self, takes_outlines: bool) -> tuple[Any, list[float]]:
        """Lengths, and how far each CG lies in front of the middle of its link.

        The middle of a link at an end is that of its outline where this is read, else its CG.
        """
        cg = self.middles
        joints = np.array([self._local(self.anchor[link.hinges[0]])[2] for link in self.links[1:]])
        first, last = (self._end(i) if takes_outlines else cg[i] for i in (0, -1))
        ends = [2.0 * first - joints[0], *joints, 2.0 * last - joints[-1]]
        lengths = np.round(np.diff(ends), 12)  # [m], without the round-off of sums along the chain
        self.middles = [0.5 * (front + rear) for front, rear in itertools.pairwise(ends)]
        offsets = np.round(np.subtract(self.middles, cg), 12)
        offsets[np.abs(offsets) <= self.tolerance] = 0.0
        for i, link in enumerate(self.links):
            if not lengths[i] > 0.0:
                expected = "> 0, with joints, and outlines or CGs at the ends, in the order of the links; or length="
                raise self._error("body", link.bodies[0], f"length {lengths[i]:g} m", expected)
            off = abs(offsets[i])
            if off >= 0.5 * lengths[i]:
                expected = f"less than half of its length, {0.5 * lengths[i]:g} m; or length="
                raise self._error("body", link.bodies[0], f"CG {off:g} m off the middle of the link", expected)
        return _same(lengths.tolist()), offsets.tolist()

    def _end(self, i: int) -> float:
        """Where the middle of a link at an end is, along the line: of its outline, or its CG within the tolerance."""
        middle, cg = float(self._local(self._geom(i)[1])[2]), self.middles[i]
        return cg if abs(middle - cg) <= self.tolerance else middle

    def _inertias(self, i: int) -> tuple[float, float]:
        """About an axis across the link, and along it."""
        tensor = self.frame @ self.masses[i][2] @ self.frame.T
        across, along = 0.5 * (tensor[0, 0] + tensor[1, 1]), tensor[2, 2]
        if np.abs(tensor - np.diag([across, across, along])).max() > ROUNDED * max(across, along):
            upper = [f"{value:.3g}" for value in tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]]
            expected = "equal inertias across the link, and no products; or inertia= and roll_inertia="
            body = self.links[i].bodies[0]
            raise self._error("body", body, f"inertia (xx yy zz xy xz yz, z along) {' '.join(upper)} kg m^2", expected)
        return float(across), float(along)

    def _geom(self, i: int) -> tuple[int, Array]:
        """The one geom of a link that collides, or the one that it has, and its centre."""
        model, kinds, bodies = self.model, self.library.mjtGeom, self.links[i].bodies
        geoms = np.flatnonzero(np.isin(model.geom_bodyid, bodies))
        colliding = geoms[(model.geom_contype[geoms] | model.geom_conaffinity[geoms]) != 0]
        geoms = colliding if colliding.size else geoms
        expected = "one capsule, cylinder or sphere, or radius= and contact_half_length="
        names = [kinds(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower() for geom in geoms]
        if len(names) != 1 or names[0] not in ("capsule", "cylinder", "sphere"):
            raise self._error("body", bodies[0], " and ".join(names[:5]) or "no geom", expected)
        (geom,) = geoms.tolist()
        body = model.geom_bodyid[geom]
        return geom, self.origin[body] + self.turn[body] @ model.geom_pos[geom]

    def _outline(self, i: int) -> tuple[float, float]:
        """Radius and half length of the capsule around the geom of a link."""
        model, (geom, centre) = self.model, self._geom(i)
        kind = self.library.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
        radius, half = model.geom_size[geom, :2].tolist() if kind != "sphere" else (model.geom_size[geom, 0], 0.0)
        direction = self.turn[model.geom_bodyid[geom]] @ self._matrix(model.geom_quat[geom])[:, 2]
        middle = np.linalg.norm(self._local(centre) - (0.0, 0.0, self.middles[i]))
        aside = middle + half * np.linalg.norm(np.cross(direction, self.frame[2]))
        if aside > self.tolerance:
            expected = (
                f"one around the middle of the link, along it, within {self.tolerance:g} m or a larger tolerance="
            )
            raise self._error("geom", geom, f"{kind} {aside:g} m aside", expected)
        return float(radius), half

    def _axes(self, link: _Link) -> Any:
        """The entry of ``Robot.axes`` for the joint before a link."""
        axes = [_named(self.frame @ self.axis[hinge]) for hinge in link.hinges]
        if axes == ["yaw", "pitch"]:
            apart = np.linalg.norm(np.subtract(*self.anchor[link.hinges]))
            if apart > max(POINT, self.tolerance):
                expected = f"in one point with the first, within {max(POINT, self.tolerance):g} m"
                raise self._error("joint", link.hinges[-1], f"{apart:g} m apart", expected)
            return "both"
        if len(axes) != 1:
            expected = "one hinge, or two of a cardan joint: yaw, then pitch"
            text = ", ".join(str(axis if isinstance(axis, str) else np.round(axis, 4).tolist()) for axis in axes)
            raise self._error("joint", link.hinges[-1], f"axes {text}", expected)
        return axes[0]

    def _limit(self, link: _Link) -> Any:
        """The entry of ``Robot.joint_limit`` for the joint before a link; angles are zero in the straight robot."""
        model = self.model
        limited = model.jnt_limited[link.hinges, None] & (not self.actuation.is_off("LIMIT"))
        of_hinges = np.where(limited, model.jnt_range[link.hinges], [-np.inf, np.inf])
        of_hinges -= model.qpos0[model.jnt_qposadr[link.hinges], None]
        lower, upper = of_hinges[0].tolist()
        for hinge, (low, high) in zip(link.hinges, of_hinges, strict=True):
            first, last = model.jnt_range[hinge]
            if first > last or (first == last and model.joint(hinge).name in self.revolute):
                expected = "lower < upper, which MuJoCo takes for no limit otherwise, or joint_limit="
                raise self._error("joint", hinge, f"limits ({first:g}, {last:g}) rad", expected)
            if np.isfinite(high) and max(-low, high) > LARGEST_LIMIT:
                expected = f"within [-{LARGEST_LIMIT}, {LARGEST_LIMIT}], no limit, or joint_limit="
                raise self._error("joint", hinge, f"limits ({low:g}, {high:g}) rad", expected)
            if not (low <= 0.0 <= high and np.allclose((low, high), (lower, upper), rtol=0.0)):
                expected = "lower <= 0 <= upper, equal for both axes of a cardan joint, or joint_limit="
                raise self._error("joint", hinge, f"limits ({low:g}, {high:g}) rad", expected)
        return upper if lower == -upper else (lower, upper)

    def _left_out(self, bodies: list[int]) -> Iterator[str]:
        """What the file has and the robot does not."""
        model = self.model
        locked, limp = (
            [hinge for joint in joints for hinge in self.links[joint + 1].hinges]
            for joints in (self.actuation.locked, self.actuation.limp)
        )
        hinges = [hinge for hinge in self.hinges if hinge not in locked]
        dofs, held = model.jnt_dofadr[hinges], (model.qpos_spring - model.qpos0)[model.jnt_qposadr[locked]]

        # 1 for hinges whose values no motor has, 0 for the others.
        others = np.where(np.isin(hinges, self.actuation.driven) & self.takes_motor, 0.0, 1.0)

        for body in self.crosses:
            if model.body_mass[body]:
                yield f"the motion of {self._name('body', body)} ({model.body_mass[body]:g} kg) in the link behind it"
        for joint in self.supports:
            yield f"{self._name('joint', joint)}, between the robot and the world"
        for kind, numbers, name, values, unit in (
            ("joint", hinges, "damping", model.dof_damping[dofs] * others, "N m s/rad"),
            ("joint", hinges, "frictionloss", model.dof_frictionloss[dofs] * others, "N m"),
            ("joint", hinges, "armature", model.dof_armature[dofs] * others, "kg m^2"),
            ("joint", hinges, "stiffness", model.jnt_stiffness[hinges], "N m/rad"),
            ("joint", hinges, "nonlinear damping", np.abs(model.dof_dampingpoly[dofs]).max(axis=1), "at most"),
            ("joint", hinges, "nonlinear stiffness", np.abs(model.jnt_stiffnesspoly[hinges]).max(axis=1), "at most"),
            ("joint", locked, "angle of the lock", held, "rad, the start's"),
            ("body", bodies, "gravcomp", model.body_gravcomp[bodies], "of the weight"),
        ):
            present = np.flatnonzero(values)
            if present.size:
                more = f" and {present.size - 1} more" if present.size > 1 else ""
                largest = values[present[np.abs(values[present]).argmax()]]
                yield f"{name} of {self._name(kind, numbers[present[0]])}{more} ({largest:g} {unit})"
        if model.opt.gravity[:2].any() or model.opt.gravity[2] > 0.0:
            yield f"the direction of option gravity ({' '.join(f'{part:g}' for part in model.opt.gravity)})"
        if model.nexclude:
            yield f"{model.nexclude} contact exclusions"
        for name in ("density", "viscosity"):
            if value := getattr(model.opt, name):
                yield f"option {name} ({value:g})"
        if passive := [hinge for hinge in self.actuation.undriven() if hinge not in (*locked, *limp)]:
            more = f" and {len(passive) - 1} more" if len(passive) > 1 else ""
            yield f"that no actuator drives {self._name('joint', passive[0])}{more} (limp= says so)"
        if model.ntendon:
            yield f"{self._name('tendon', 0)}" + (f" and {model.ntendon - 1} more" if model.ntendon > 1 else "")


def _same(values: Any) -> Any:
    """One value in place of equal ones, if a field admits it for all links or joints, or a tuple of them."""
    first = values[0]
    return first if isinstance(first, str | float) and all(value == first for value in values) else tuple(values)


def _named(vector: Array) -> Any:
    """Name of a unit vector of the link frame, or its components."""
    whole = np.round(vector)
    if np.abs(vector - whole).max() < ROUNDED:
        vector = whole + 0.0  # without -0.0
    components = tuple(vector.tolist())
    return UNIT_AXES.get(components, components)
