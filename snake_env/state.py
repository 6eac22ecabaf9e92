"""The state of robots, as arrays for all of them at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """n robots of L links at a control instant, in the world frame; all arrays are C-contiguous float64 and belong to
    the caller. The state of a single environment has no first axis.

    Attributes:
        time: (n,) since the start of the episode [s].
        position: (n, 2) centre of gravity, seen from above [m].
        velocity: (n, 2) its velocity [m/s].
        heading: (n,) angle from +x to the mean direction of the body [rad], in [-pi, pi].
        energy: (n,) kinetic and potential energy, the latter zero with every CG at the height of the origin: on level
            ground always in the plane [J]. ``info["energy"]`` is the positive work of the actuators.
        distance: (n,) distance of the centre of gravity towards the goal, gained since the start [m].
        reward_terms: (n, t) value of each built-in reward term in the last step, without its weight, in the order of
            :data:`snake_env.rewards.TERMS`.
        goal: (n, 2) centre of the goal disc, end of the path, or where the corridor's centre line meets the goal line
            [m]. NaN where the goal is a direction.
        goal_radius: (n,) of the goal disc, or the length at the end of a path that need not be covered; 0 for a goal
            line [m].
        goal_direction: (n,) angle from +x to the goal direction [rad].
        goal_speed: (n,) commanded speed along it; 0 without a command [m/s].
        corridor_half_width: (n,) distance from the centre line at which a robot with a goal line has left the
            corridor [m].
        link_position: (n, L, 2) CGs of the links [m]; (n, L, 3) in 3D.
        link_velocity: (n, L, 2) their velocities [m/s]; (n, L, 3) in 3D.
        link_angular_velocity: (n, L) [rad/s]; (n, L, 3) in 3D.
        joint_angle: (n, L - 1) [rad]; (n, L - 1, 2) in 3D, yaw and pitch, which lowers the links behind its joint.
            (n, a) of a robot with ``axes`` of its own, see :attr:`snake_env.Robot.joint_axes`.
        joint_rate: of the same shape [rad/s].
        joint_torque: of the same shape, of the actuators in the last integration step, thesis sign [N m].
        contact_force: (n, L, 2) force of the obstacles on each link, mean over the last control period [N]. (n, L, 3)
            in 3D, with the normal force and friction of top faces.
        self_contact_force: of the same shape, force of the robot's other links [N]; zero where the model has none.
        link_half_length: (L,) half length of the straight sides of a link's outline [m].
        link_radius: (L,) half width of a link and radius of its round ends [m].
        link_cg_offset: (L,) how far the CG lies in front of the middle of a link [m].
        link_angle: (n, L) absolute angles of the links [rad]; None in 3D.
        link_quaternion: (n, L, 4) orientations of the links, w first; 3D only.
        normal_force: (n, L) normal force of the ground, without that of top faces, averaged over the last control
            period [N]; 3D only.
        obstacles: (n, k, 3) radius and centre (radius, x, y) of the fixed pegs, NaN where a robot has fewer than k [m].
        obstacle_position: (n, q, 2) centres of the obstacles that can be pushed [m], in the order of
            ``scene(i).obstacles``, which has where they were at first. NaN where a robot has fewer than q.
        obstacle_angle: (n, q) by how much they have turned about the vertical since then, likewise [rad].
        obstacle_height: (n, q) of the centres of spheres above the plane, 0 of all else, likewise [m].
        obstacle_force: (n, m, 2|3) force of each obstacle on the robot, likewise, in the order of
            ``scene(i).obstacles`` [N]. NaN where a robot has fewer than m.
        path: (n, p, 2) corners of the path to follow, NaN where a robot's has fewer than p [m].
        info: what ``info`` reports, (n,) each; for reward and termination functions, else empty.
    """

    time: Array
    position: Array
    velocity: Array
    heading: Array
    energy: Array
    distance: Array
    reward_terms: Array
    goal: Array
    goal_radius: Array
    goal_direction: Array
    goal_speed: Array
    corridor_half_width: Array
    link_position: Array
    link_velocity: Array
    link_angular_velocity: Array
    joint_angle: Array
    joint_rate: Array
    joint_torque: Array
    contact_force: Array
    self_contact_force: Array
    obstacles: Array
    obstacle_position: Array
    obstacle_angle: Array
    obstacle_height: Array
    obstacle_force: Array
    path: Array
    link_half_length: Array
    link_radius: Array
    link_cg_offset: Array
    link_angle: Array | None = None
    link_quaternion: Array | None = None
    normal_force: Array | None = None
    info: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The entry of ``info`` of a name."""
        return self.info[name]

    def robot(self, i: int) -> State:
        """The state of robot ``i``, without the first axis."""
        rows = {name: value[i] for name, value in self.arrays().items() if name not in CONSTANT}
        for name in RAGGED:
            has = np.isfinite(rows[name]).all(axis=tuple(range(1, rows[name].ndim)))
            rows[name] = np.ascontiguousarray(rows[name][has])
        return replace(self, **rows, info={name: value[i] for name, value in self.info.items()})

    def arrays(self) -> dict[str, Array]:
        """All arrays by name; those that the model does not have are absent."""
        values = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "info"}
        return {name: value for name, value in values.items() if value is not None}

    @property
    def link_axis(self) -> Array:
        """Unit vectors along the centre lines of the links, towards the next link, (n, L, 2); (n, L, 3) in 3D."""
        if self.link_quaternion is None:
            angle = np.asarray(self.link_angle)
            return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return centre_line(self.link_quaternion)

    @property
    def link_middle(self) -> Array:
        """Middles of the links, about which their outlines lie, (n, L, 2) [m]; (n, L, 3) in 3D."""
        return self.link_position + self.link_cg_offset[:, np.newaxis] * self.link_axis

    @property
    def link_back(self) -> Array:
        """Unit vectors from the centre lines of the links to their backs, (n, L, 3): up where a robot lies flat."""
        if self.link_quaternion is None:
            return np.broadcast_to([0.0, 0.0, 1.0], (*np.asarray(self.link_angle).shape, 3))
        return back(self.link_quaternion)

    def __repr__(self) -> str:
        return f"State({', '.join(f'{name}{value.shape}' for name, value in self.arrays().items())})"


def centre_line(quaternion: Array) -> Array:
    """Unit vectors (..., 3) along the centre lines of links with orientations (..., 4), w first."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    return np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)], axis=-1)


def back(quaternion: Array) -> Array:
    """Unit vectors (..., 3) from the centre lines to the backs of links in 3D, the axis of yaw."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    return np.stack([2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)], axis=-1)


CONSTANT = ("link_half_length", "link_radius", "link_cg_offset")
"""What all robots of a batch share."""
RAGGED = ("obstacles", "obstacle_position", "obstacle_angle", "obstacle_height", "obstacle_force", "path")
"""Tables whose lengths differ between robots, filled up with NaN in a batch."""


def in_infos(state: State, names: Sequence[str], mask: NDArray[np.bool_]) -> dict[str, Any]:
    """Quantities of all robots as Gymnasium's ``infos`` have them: zero where ``mask`` is False, and with masks."""
    entries: dict[str, Any] = {}
    for name in names:
        values = getattr(state, name)
        values[~mask] = 0.0
        entries |= {name: values, f"_{name}": mask.copy()}
    return entries


def state_of(
    native: Any, layout: Mapping[str, Any], rows: Sequence[int], info: Mapping[str, NDArray[Any]] | None = None
) -> State:
    """The state of some robots of a batch of the core."""
    return State(**native.state(rows), **{name: np.array(layout[name]) for name in CONSTANT}, info=info or {})
