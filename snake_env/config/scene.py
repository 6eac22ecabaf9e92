"""Pegs and ground."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from snake_env import _checks
from snake_env._native import courses
from snake_env.config.section import PYTHON_ONLY, Section, core_defaults
from snake_env.errors import ConfigError

_GROUND = core_defaults("scene")
_CONSTANT = core_defaults("stribeck")


@dataclass(frozen=True)
class Stribeck(Section):
    """The Stribeck effect (T 7.5.4): friction that falls once a link slides, mu (1 - drop v^2 / (v^2 + speed^2)).

    The coefficients of friction are those of a link at rest.

    Args:
        drop: share of the friction that is lost in fast sliding, 0 to 1; zero switches the effect off.
        speed: sliding speed at which half of that is lost [m/s], > 0.
    """

    _section = "stribeck"

    drop: float = _CONSTANT.drop
    speed: float = _CONSTANT.speed


@dataclass(frozen=True)
class Scene(Section):
    """Circular pegs fixed to the ground, and the ground's friction.

    Args:
        obstacles: pegs as triples (radius, x, y) [m]; radius > 0.
        friction: Coulomb coefficients along and across a link (mu_x, mu_y), >= 0.
        rolling_friction: coefficient mu_V of the friction that resists rolling (T 4.87), >= 0; the spatial model only.
        stribeck: how friction falls in sliding; the planar model only.
        viscous: viscous coefficients along and across a link (mu_Vx, mu_Vy) [s/m], >= 0; the minimal model only.
        friction_law: "set-valued", the exact Coulomb law; for the minimal model also "arctan" (T 6.21), a box, and
            "ellipse", -D^2 v / sqrt(v^T D^2 v + eps^2) with D = diag(friction) times a contact point's normal force.
        smoothing: eps of the smooth laws, > 0: [m/s] for "arctan", [N m/s] for "ellipse".
        course: name of the preset that the scene was made from, for :meth:`Start.on_course`.
    """

    _section = "scene"

    obstacles: Sequence[tuple[float, float, float]] = _GROUND.obstacles
    friction: tuple[float, float] = _GROUND.friction
    rolling_friction: float = _GROUND.rolling_friction
    stribeck: Stribeck = Stribeck()
    viscous: tuple[float, float] = _GROUND.viscous
    friction_law: str = _GROUND.friction_law
    smoothing: float = _GROUND.smoothing
    course: str | None = field(default=None, metadata=PYTHON_ONLY)

    def __post_init__(self) -> None:
        _checks.choice("scene.course", self.course, [None, *courses()])
        if not isinstance(self.stribeck, Stribeck):
            raise ConfigError("scene.stribeck", repr(self.stribeck), "a snake_env.Stribeck")
        super().__post_init__()

    @classmethod
    def preset(cls, name: str, friction: tuple[float, float] = _GROUND.friction) -> Scene:
        """A course of the thesis: "table-7.3", "table-7.5" or "free" (no obstacles)."""
        pegs = [tuple(peg) for peg in course(name)["obstacles"]]
        return cls(obstacles=pegs, friction=friction, course=name)

    def without(self, j: int) -> Scene:
        """The scene without obstacle ``j`` (1-based, as in the thesis)."""
        k = self._index(j)
        return dataclasses.replace(self, obstacles=[*self.obstacles[:k], *self.obstacles[k + 1 :]])

    def moved(self, j: int, dx: float, dy: float) -> Scene:
        """The scene with obstacle ``j`` (1-based) shifted by (dx, dy) [m]."""
        k = self._index(j)
        radius, x, y = self.obstacles[k]
        shifted = (radius, x + dx, y + dy)
        return dataclasses.replace(self, obstacles=[*self.obstacles[:k], shifted, *self.obstacles[k + 1 :]])

    def _index(self, j: int) -> int:
        count = len(self.obstacles)
        if not 1 <= j <= count:
            raise ConfigError("obstacle", j, f"an integer in [1, {count}]")
        return j - 1


def course(name: str) -> dict[str, Any]:
    """Obstacles and starts of a course of the thesis."""
    known = courses()
    if not isinstance(name, str) or name not in known:
        raise ConfigError("preset", repr(name), "one of " + ", ".join(f'"{key}"' for key in known))
    return known[name]
