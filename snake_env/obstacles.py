"""Obstacles of a scene: pegs, walls and convex bodies by their outlines, seen from above, fixed or to be pushed.

In the spatial model these are vertical bodies, without end or of a height. There are others: uneven ground, convex
polyhedra, poles, pipes, and spheres that roll. All else that can be pushed stays upright there, and meets vertical
bodies and spheres only. Lengths in m, angles in rad.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeGuard

import numpy as np
from numpy.typing import NDArray

from snake_env import _checks
from snake_env.config.section import Section, renamed
from snake_env.errors import ConfigError

__all__ = ["Box", "Circle", "Cylinder", "HeightField", "Obstacle", "Polygon", "Polyhedron", "Segment", "Sphere"]

GROUND_FRICTION = 0.2
"""Of what can be pushed where it has no coefficient of its own."""
ROLLING_FRICTION = 0.02
"""Of spheres, likewise."""

Point = tuple[float, float]
Point3 = tuple[float, float, float]


class _Body(Section):
    """What all obstacles have in common."""

    _section: ClassVar[str] = "obstacle"

    def __post_init__(self) -> None:
        # The core leaves out what is None, and would name the whole obstacle.
        for one in dataclasses.fields(self):  # type: ignore[arg-type]
            if one.default is dataclasses.MISSING and getattr(self, one.name) is None:
                raise ConfigError(f"obstacle.{one.name}", None, "a value")
        super().__post_init__()


@dataclass(frozen=True)
class Circle(_Body):
    """A peg, with a mass a disc that can be pushed, with a stiffness a peg that yields. It is at x and y at first.

    Args:
        radius: radius [m], > 0.
        x: centre [m].
        y: centre [m].
        friction: Coulomb coefficient between links and the obstacle, >= 0; 0 with a mass.
        mass: of a homogeneous disc, > 0; None: fixed [kg].
        height: of the top face above the ground, > 0; None: without end, as with a mass. The spatial model only [m].
        ground_friction: Coulomb coefficient between the ground and the disc, which presses on it evenly. It resists
            sliding with at most mu m g and spin with at most 2/3 R mu m g. None: 0.2, as of links, 0 with a spring.
            Only with a mass.
        stiffness: of a spring that holds the disc at x and y in either direction, >= 0; None: no spring. Only with a
            mass [N/m].
        damping: of a damper beside the spring, >= 0; None: 0. Only with a stiffness [N s/m].
        travel: how far the disc gives way before it meets a rigid stop, > 0; None: any distance. Only with a
            stiffness [m].
    """

    radius: float
    x: float
    y: float
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
    ground_friction: float | None = None
    stiffness: float | None = None
    damping: float | None = None
    travel: float | None = None
    shape: str = field(default="circle", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Circle:
        """The obstacle shifted by (dx, dy) [m]."""
        ((x, y),) = _shifted([(self.x, self.y)], dx, dy)
        return dataclasses.replace(self, x=x, y=y)


@dataclass(frozen=True)
class Segment(_Body):
    """A straight wall without thickness; links touch both sides and the ends.

    Args:
        start: one end (x, y) [m].
        end: the other end (x, y) [m].
        friction: Coulomb coefficient between links and the obstacle, >= 0.
        mass: None; only circles, boxes, polygons and spheres can be pushed.
        height: of the top face above the ground, > 0; None: without end. The spatial model only [m].
    """

    start: Point
    end: Point
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
    shape: str = field(default="segment", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Segment:
        """The obstacle shifted by (dx, dy) [m]."""
        start, end = _shifted([self.start, self.end], dx, dy)
        return dataclasses.replace(self, start=start, end=end)


@dataclass(frozen=True)
class Box(_Body):
    """A rectangle.

    Args:
        size: lengths of its sides [m], > 0.
        x: centre [m].
        y: centre [m].
        angle: of the first side, from the x axis [rad].
        friction: Coulomb coefficient between links and the obstacle, >= 0.
        mass: of a homogeneous box that can be pushed, > 0; None: fixed [kg].
        height: of the top face above the ground, > 0; None: without end, as with a mass. The spatial model only [m].
        ground_friction: as of a :class:`Circle`. It resists sliding and spin together, see docs/method.md. Only with a
            mass.
    """

    size: Point
    x: float
    y: float
    angle: float = 0.0
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
    ground_friction: float | None = None
    shape: str = field(default="box", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Box:
        """The obstacle shifted by (dx, dy) [m]."""
        ((x, y),) = _shifted([(self.x, self.y)], dx, dy)
        return dataclasses.replace(self, x=x, y=y)


@dataclass(frozen=True)
class Polygon(_Body):
    """A convex polygon.

    Args:
        vertices: three or more corners (x, y) in order, either way round [m]. Vertices that repeat their neighbour,
            close the ring or lie on a straight edge within round-off, a billionth of the polygon, are left out.
        friction: Coulomb coefficient between links and the obstacle, >= 0.
        mass: of a homogeneous polygon that can be pushed, > 0; None: fixed [kg].
        height: of the top face above the ground, > 0; None: without end, as with a mass. The spatial model only [m].
        ground_friction: as of a :class:`Circle`. It resists sliding and spin together, see docs/method.md. Only with a
            mass.
    """

    vertices: Sequence[Point]
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
    ground_friction: float | None = None
    shape: str = field(default="polygon", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Polygon:
        """The obstacle shifted by (dx, dy) [m]."""
        return dataclasses.replace(self, vertices=_shifted(self.vertices, dx, dy))


@dataclass(frozen=True)
class HeightField(_Body):
    """Uneven ground: heights on a grid, joined by triangles. The spatial model only.

    Inside its rectangle the field is the ground; outside, the ground is the plane z = 0. Each cell has two triangles,
    which meet in the diagonal from its first corner, as in MuJoCo. At its border the field ends in vertical faces.

    Args:
        height: array (k, l) of heights at ``origin + (i, j) * spacing``, k, l >= 2 [m].
        spacing: between neighbours along either axis, > 0 [m].
        origin: (x, y) of the first height [m].
        friction: Coulomb coefficient of all faces, or an array (k - 1, l - 1) of one for each cell, >= 0. None: links
            have the scene's coefficients along and across them, on level faces with all else the ground's friction has,
            such as rolling friction.
        mass: None; only circles, boxes, polygons and spheres can be pushed.
    """

    height: Sequence[Sequence[float]]
    spacing: float
    origin: Point = (0.0, 0.0)
    friction: float | Sequence[Sequence[float]] | None = None
    mass: float | None = None
    shape: str = field(default="height_field", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> HeightField:
        """The field shifted by (dx, dy) [m]."""
        (origin,) = _shifted([self.origin], dx, dy)
        return dataclasses.replace(self, origin=origin)


@dataclass(frozen=True)
class Polyhedron(_Body):
    """A convex body, such as a ramp or a piece of rubble. The spatial model only.

    Args:
        vertices: 4 to 64 points (x, y, z) that do not lie in one plane; the body is their convex hull [m].
        friction: Coulomb coefficient between links and the body, >= 0.
        mass: None; only circles, boxes, polygons and spheres can be pushed.
    """

    vertices: Sequence[Point3]
    friction: float = 0.0
    mass: float | None = None
    shape: str = field(default="polyhedron", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Polyhedron:
        """The body shifted by (dx, dy) [m]."""
        return dataclasses.replace(self, vertices=_shifted3(self.vertices, dx, dy))


@dataclass(frozen=True)
class Cylinder(_Body):
    """A pole, or a pipe, in any direction. The spatial model only.

    Args:
        start: centre (x, y, z) of one end [m].
        end: centre of the other end [m].
        radius: radius [m], > 0.
        inside: False: a solid pole with flat ends. True: a pipe, a wall without thickness that links touch on both
            sides, and open ends with rims.
        friction: Coulomb coefficient between links and the cylinder, >= 0.
        mass: None; only circles, boxes, polygons and spheres can be pushed.
    """

    start: Point3
    end: Point3
    radius: float
    inside: bool = False
    friction: float = 0.0
    mass: float | None = None
    shape: str = field(default="cylinder", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Cylinder:
        """The cylinder shifted by (dx, dy) [m]."""
        start, end = _shifted3([self.start, self.end], dx, dy)
        return dataclasses.replace(self, start=start, end=end)


@dataclass(frozen=True)
class Sphere(_Body):
    """A homogeneous ball that rolls, slides and falls. The spatial model with the method "implicit" only.

    It touches links, other spheres and all that is fixed in space, and upright bodies that can be pushed at the height
    of its centre. Links and all that can be pushed have no friction with it; what is fixed has its own ``friction``.

    Args:
        radius: radius [m], > 0.
        x: centre at first [m].
        y: centre at first [m].
        mass: of the ball, > 0 [kg].
        z: height of the centre over the plane at first. None: the radius, a ball that lies on the ground [m].
        ground_friction: Coulomb coefficient where it slides on the plane, on top faces, and on height fields without a
            friction of their own, >= 0. None: 0.2.
        rolling_friction: coefficient as that of the links, >= 0. While something carries the ball, a moment resists
            that it rolls, and another one that it spins. Each is at most rolling_friction * radius * m g. None: 0.02.
    """

    radius: float
    x: float
    y: float
    mass: float
    z: float | None = None
    ground_friction: float | None = None
    rolling_friction: float | None = None
    shape: str = field(default="sphere", init=False, repr=False)

    @property
    def height(self) -> float:
        """Of its centre [m]."""
        return self.radius if self.z is None else self.z

    def moved(self, dx: float, dy: float) -> Sphere:
        """The sphere shifted by (dx, dy) [m]."""
        ((x, y),) = _shifted([(self.x, self.y)], dx, dy)
        return dataclasses.replace(self, x=x, y=y)


Vertical = Circle | Segment | Box | Polygon
Movable = Circle | Box | Polygon | Sphere
Obstacle = Vertical | HeightField | Polyhedron | Cylinder | Sphere

_SHAPES: dict[str, type[Obstacle]] = {
    "circle": Circle,
    "segment": Segment,
    "box": Box,
    "polygon": Polygon,
    "height_field": HeightField,
    "polyhedron": Polyhedron,
    "cylinder": Cylinder,
    "sphere": Sphere,
}


def circles(obstacles: Sequence[Any]) -> list[tuple[float, float, float]]:
    """Radius and centre (radius, x, y) of the circular ones [m]."""
    triples = [(one.radius, one.x, one.y) if isinstance(one, Circle) else one for one in obstacles]
    return [tuple(one) for one in triples if not isinstance(one, Obstacle)]


def is_movable(obstacle: Any) -> TypeGuard[Movable]:
    """Whether it can be pushed."""
    return getattr(obstacle, "mass", None) is not None


def ground_friction(obstacle: Movable) -> float:
    """Coulomb coefficient between an obstacle that can be pushed and the ground."""
    is_held = isinstance(obstacle, Circle) and obstacle.stiffness is not None
    of_ground = 0.0 if is_held else GROUND_FRICTION
    return of_ground if obstacle.ground_friction is None else obstacle.ground_friction


def centre(obstacle: Movable) -> NDArray[np.float64]:
    """(x, y) of its centroid [m]."""
    if not isinstance(obstacle, Polygon):
        return np.array([obstacle.x, obstacle.y])
    first, *others = np.array(obstacle.vertices, np.float64)
    arms = np.array(others) - first
    doubled = arms[:-1, 0] * arms[1:, 1] - arms[:-1, 1] * arms[1:, 0]
    return np.asarray(first + doubled @ (arms[:-1] + arms[1:]) / (3.0 * doubled.sum()))


def balls(obstacles: Sequence[Any]) -> NDArray[np.float64]:
    """Radius and centre (radius, x, y, z) of the spheres (k, 4) [m]."""
    found = [(one.radius, one.x, one.y, one.height) for one in obstacles if isinstance(one, Sphere)]
    return np.array(found, np.float64).reshape(-1, 4)


def placed(obstacles: Sequence[Any], position: Any, angle: Any = None, height: Any = None) -> list[Any]:
    """The same obstacles with the k that can be pushed at (k, 2) [m], turned by (k,) [rad] from where they are.

    The centres of spheres are at the heights in (k,), or stay at their own [m].
    """
    turns = np.zeros(len(position)) if angle is None else angle
    raised = [None] * len(position) if height is None else np.asarray(height).tolist()
    places = zip(np.asarray(position).tolist(), np.asarray(turns).tolist(), raised, strict=True)
    return [_turned(one, *next(places)) if is_movable(one) else one for one in obstacles]


def _turned(obstacle: Movable, place: Sequence[float], turn: float, height: float | None) -> Movable:
    if isinstance(obstacle, Circle):
        return dataclasses.replace(obstacle, x=place[0], y=place[1])
    if isinstance(obstacle, Sphere):
        return dataclasses.replace(obstacle, x=place[0], y=place[1], z=obstacle.z if height is None else height)
    if isinstance(obstacle, Box):
        return dataclasses.replace(obstacle, x=place[0], y=place[1], angle=obstacle.angle + turn)
    arms = np.array(obstacle.vertices, np.float64) - centre(obstacle)
    sin, cos = np.sin(turn), np.cos(turn)
    return dataclasses.replace(obstacle, vertices=(arms @ [[cos, sin], [-sin, cos]] + place).tolist())


def springs(obstacles: Sequence[Any], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where springs hold discs, and where these are (s, 2, 2) [m]; the k that can be pushed are at (k, 2)."""
    movable = zip(filter(is_movable, obstacles), position, strict=True)
    ends = [[(one.x, one.y), at] for one, at in movable if isinstance(one, Circle) and one.stiffness is not None]
    return np.array(ends, np.float64).reshape(-1, 2, 2)


def outlines(obstacles: Sequence[Any]) -> list[NDArray[np.float64]]:
    """Corners (k, 2) of the other vertical ones in order, two of a segment [m]."""
    return [_corners(one) for one in obstacles if isinstance(one, Segment | Box | Polygon)]


def heights(obstacles: Sequence[Any]) -> tuple[list[float | None], list[float | None]]:
    """Heights of the circular ones, as :func:`circles` lists them, and of the others [m]; None: without end."""
    others = [one.height for one in obstacles if isinstance(one, Segment | Box | Polygon)]
    round_ones = [one for one in obstacles if isinstance(one, Circle) or not isinstance(one, Obstacle)]
    return [one.height if isinstance(one, Circle) else None for one in round_ones], others


def solids(obstacles: Sequence[Any]) -> list[tuple[float, NDArray[np.float64]]]:
    """Heights of the obstacles that have one, and corners (k, 2) of their outlines, round ones as polygons [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    solid = [one for one in obstacles if isinstance(one, Vertical) and one.height is not None]
    corners = [one.radius * rim + [one.x, one.y] if isinstance(one, Circle) else _corners(one) for one in solid]
    return [(float(one.height or 0.0), line) for one, line in zip(solid, corners, strict=True)]


def moved(obstacle: Any, dx: float, dy: float) -> Any:
    """An obstacle of a scene, or a triple (radius, x, y), shifted by (dx, dy) [m]."""
    if isinstance(obstacle, Obstacle):
        return obstacle.moved(dx, dy)
    radius, *centre = obstacle
    return radius, *_shifted([tuple(centre)], dx, dy)[0]


def to_plain(obstacle: Any) -> Any:
    """An obstacle as numbers, lists and mappings; a triple is a list."""
    if not isinstance(obstacle, Obstacle):
        return np.asarray(obstacle, np.float64).tolist()
    names = ["shape", *(name.name for name in dataclasses.fields(obstacle) if name.init)]
    values = {name: getattr(obstacle, name) for name in names}
    return {name: _plain(value) for name, value in values.items() if value is not None}


def from_plain(obstacle: Any, path: str) -> Any:
    """The obstacle that :func:`to_plain` wrote; ``path`` names it in errors.

    Raises:
        ConfigError: names the field that is unknown, missing or not admissible.
    """
    if not isinstance(obstacle, Mapping):
        return obstacle
    fields = dict(obstacle)
    shape = fields.pop("shape", None)
    if not isinstance(shape, str) or shape not in _SHAPES:
        raise ConfigError(f"{path}.shape", repr(shape), "one of " + ", ".join(f'"{name}"' for name in _SHAPES))
    known = [name.name for name in dataclasses.fields(_SHAPES[shape]) if name.init]
    for name, value in fields.items():
        if name not in known:
            raise ConfigError(f"{path}.{name}", repr(value), f"a field of a {shape}: " + ", ".join(known))
    try:
        return _SHAPES[shape](**fields)
    except TypeError:
        required = [
            one.name for one in dataclasses.fields(_SHAPES[shape]) if one.init and one.default is dataclasses.MISSING
        ]
        raise ConfigError(path, repr(obstacle), f"a {shape} with " + ", ".join(required)) from None
    except ConfigError as error:
        raise renamed(error, "obstacle", path) from None


def _corners(obstacle: Segment | Box | Polygon) -> NDArray[np.float64]:
    if isinstance(obstacle, Segment):
        return np.array([obstacle.start, obstacle.end], np.float64)
    if isinstance(obstacle, Polygon):
        return np.array(obstacle.vertices, np.float64)
    half = 0.5 * np.array(obstacle.size) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    sin, cos = np.sin(obstacle.angle), np.cos(obstacle.angle)
    return half @ [[cos, sin], [-sin, cos]] + [obstacle.x, obstacle.y]


def _shifted(points: Sequence[Point], dx: float, dy: float) -> list[Point]:
    dx, dy = _checks.number("dx", dx), _checks.number("dy", dy)
    return [(x + dx, y + dy) for x, y in points]


def _shifted3(points: Sequence[Point3], dx: float, dy: float) -> list[Point3]:
    above = _shifted([(x, y) for x, y, _ in points], dx, dy)
    return [(x, y, z) for (x, y), (_, _, z) in zip(above, points, strict=True)]


def _plain(value: Any) -> Any:
    return value if isinstance(value, str | int | float) else np.asarray(value, np.float64).tolist()
