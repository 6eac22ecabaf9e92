"""Obstacles of a scene by their outlines, seen from above: pegs, walls and convex bodies, fixed to the ground.

In the spatial model they are vertical bodies, without end or of a height. Lengths in m, angles in rad.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snake_env import _checks
from snake_env.config.section import Section, renamed
from snake_env.errors import ConfigError

__all__ = ["Box", "Circle", "Obstacle", "Polygon", "Segment"]

Point = tuple[float, float]


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
    """A peg.

    Args:
        radius: radius [m], > 0.
        x: centre [m].
        y: centre [m].
        friction: Coulomb coefficient between links and the obstacle, >= 0.
        mass: None; obstacles are fixed.
        height: of the top face above the ground, > 0; None: without end. The spatial model only [m].
    """

    radius: float
    x: float
    y: float
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
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
        mass: None; obstacles are fixed.
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
        mass: None; obstacles are fixed.
        height: of the top face above the ground, > 0; None: without end. The spatial model only [m].
    """

    size: Point
    x: float
    y: float
    angle: float = 0.0
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
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
        mass: None; obstacles are fixed.
        height: of the top face above the ground, > 0; None: without end. The spatial model only [m].
    """

    vertices: Sequence[Point]
    friction: float = 0.0
    mass: float | None = None
    height: float | None = None
    shape: str = field(default="polygon", init=False, repr=False)

    def moved(self, dx: float, dy: float) -> Polygon:
        """The obstacle shifted by (dx, dy) [m]."""
        return dataclasses.replace(self, vertices=_shifted(self.vertices, dx, dy))


Obstacle = Circle | Segment | Box | Polygon

_SHAPES: dict[str, type[Obstacle]] = {"circle": Circle, "segment": Segment, "box": Box, "polygon": Polygon}


def circles(obstacles: Sequence[Any]) -> list[tuple[float, float, float]]:
    """Radius and centre (radius, x, y) of the circular ones [m]."""
    triples = [(one.radius, one.x, one.y) if isinstance(one, Circle) else one for one in obstacles]
    return [tuple(one) for one in triples if not isinstance(one, Obstacle)]


def outlines(obstacles: Sequence[Any]) -> list[NDArray[np.float64]]:
    """Corners (k, 2) of the others in order, two of a segment [m]."""
    return [_corners(one) for one in obstacles if isinstance(one, Segment | Box | Polygon)]


def heights(obstacles: Sequence[Any]) -> tuple[list[float | None], list[float | None]]:
    """Heights of the circular ones, as :func:`circles` lists them, and of the others [m]; None: without end."""
    others = [one.height for one in obstacles if isinstance(one, Segment | Box | Polygon)]
    round_ones = [one for one in obstacles if not isinstance(one, Segment | Box | Polygon)]
    return [one.height if isinstance(one, Circle) else None for one in round_ones], others


def solids(obstacles: Sequence[Any]) -> list[tuple[float, NDArray[np.float64]]]:
    """Heights of the obstacles that have one, and corners (k, 2) of their outlines, round ones as polygons [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    solid = [one for one in obstacles if isinstance(one, Obstacle) and one.height is not None]
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
        required = [name for name in known if name not in ("angle", "friction", "mass", "height")]
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


def _plain(value: Any) -> Any:
    return value if isinstance(value, str | int | float) else np.asarray(value, np.float64).tolist()
