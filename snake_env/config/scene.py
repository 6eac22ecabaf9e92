"""Obstacles and ground."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from snake_env import _checks, mjcf
from snake_env._native import courses, defaults
from snake_env.config import scene_file
from snake_env.config.controllers import PD
from snake_env.config.gait import Gait
from snake_env.config.robot import Robot
from snake_env.config.section import PYTHON_ONLY, Section, core_defaults, frozen
from snake_env.errors import ConfigError
from snake_env.obstacles import Obstacle, from_plain, is_movable, moved, placed

if TYPE_CHECKING:
    from snake_env.config.start import Start

_GROUND = core_defaults("scene")
_CONSTANT = core_defaults("stribeck")
_SERVO = {name: defaults("environment")["controller"][name] for name in ("kp", "kd", "torque_limit")}
"""Controller of the environments."""


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
class Patch(Section):
    """A part of the ground with other friction, such as ice or a rug.

    Args:
        vertices: three or more corners (x, y) of a convex polygon in order, either way round [m].
        factor: by which the sliding coefficients of the ground are multiplied there, >= 0.
    """

    _section = "patch"

    vertices: Sequence[tuple[float, float]]
    factor: float


@dataclass(frozen=True)
class Scene(Section):
    """Obstacles, the ground's friction and its slope.

    Args:
        obstacles: circles as triples (radius, x, y) [m], radius > 0, and objects of :mod:`snake_env.obstacles`.
        friction: Coulomb coefficients along and across a link (mu_x, mu_y), >= 0.
        friction_backward: coefficient along a link that slides backward, away from link 1, >= 0, as scales have it. The
            first of ``friction`` is then that forward. None: as forward. Planar and spatial models with the method
            "implicit".
        rolling_friction: coefficient mu_V of the friction that resists rolling (T 4.87), >= 0; the spatial model only.
        spin_friction: radius R of the disc of uniform pressure under each CG that resists turning [m], >= 0. Its moment
            is set-valued and does not depend on sliding. Its bound is 2/3 R m g times the mean of sqrt((mu_x sin)^2 +
            (mu_y cos)^2) over all directions. 0: a point, which resists no turning. The planar model with the method
            "implicit" only; the end spheres of the spatial model resist turning.
        stribeck: how friction falls in sliding; not in the minimal model.
        patches: where the ground's friction differs; the last one counts where some overlap. A link of the planar model
            is where its CG is. An end sphere of the spatial model is where it touches the ground, or a top face above
            it. Height fields have friction by cell instead. Planar and spatial models with the method "implicit" and a
            PD controller.
        viscous: viscous coefficients along and across a link (mu_Vx, mu_Vy) [s/m], >= 0; the minimal model only.
        friction_law: "set-valued", the exact Coulomb law. For the minimal model also "arctan" (T 6.21), a box, and
            "ellipse", -D^2 v / sqrt(v^T D^2 v + eps^2). Here D is diag(friction) times a contact point's normal force.
        slope: (angle, direction) of the ground [rad]: the angle to the horizontal, 0 to pi/2, and where the ground
            rises, from the x axis. Coordinates stay those of the ground: z is its normal.
        smoothing: eps of the smooth laws, > 0: [m/s] for "arctan", [N m/s] for "ellipse".
        course: name of the preset that the scene was made from, for :meth:`Start.on_course`.
    """

    _section = "scene"
    _parts = MappingProxyType({"stribeck": Stribeck})

    obstacles: Sequence[tuple[float, float, float] | Obstacle] = _GROUND.obstacles
    friction: tuple[float, float] = _GROUND.friction
    friction_backward: float | None = _GROUND.friction_backward
    rolling_friction: float = _GROUND.rolling_friction
    spin_friction: float = _GROUND.spin_friction
    stribeck: Stribeck = Stribeck()
    patches: Sequence[Patch] = _GROUND.patches
    viscous: tuple[float, float] = _GROUND.viscous
    friction_law: str = _GROUND.friction_law
    smoothing: float = _GROUND.smoothing
    slope: tuple[float, float] = _GROUND.slope
    course: str | None = field(default=None, metadata=PYTHON_ONLY)

    def __post_init__(self) -> None:
        _checks.choice("scene.course", self.course, [None, *courses()])
        obstacles = frozen(self.obstacles)
        if isinstance(obstacles, tuple):
            obstacles = tuple(from_plain(one, f"scene.obstacles[{j}]") for j, one in enumerate(obstacles))
        object.__setattr__(self, "obstacles", obstacles)
        patches = frozen(self.patches)
        if isinstance(patches, tuple):
            patches = tuple(Patch.of(one, f"scene.patches[{j}]") for j, one in enumerate(patches))
        object.__setattr__(self, "patches", patches)
        super().__post_init__()

    @classmethod
    def preset(cls, name: str, friction: tuple[float, float] = _GROUND.friction) -> Scene:
        """A course of the thesis: "table-7.3", "table-7.5" or "free" (no obstacles)."""
        return cls(obstacles=course(name)["obstacles"], friction=friction, course=name)

    def without(self, j: int) -> Scene:
        """The scene without obstacle ``j`` (1-based, as in the thesis)."""
        k = self._index(j)
        return dataclasses.replace(self, obstacles=[*self.obstacles[:k], *self.obstacles[k + 1 :]])

    def moved(self, j: int, dx: float, dy: float) -> Scene:
        """The scene with obstacle ``j`` (1-based) shifted by (dx, dy) [m]."""
        k = self._index(j)
        shifted = moved(self.obstacles[k], dx, dy)
        return dataclasses.replace(self, obstacles=[*self.obstacles[:k], shifted, *self.obstacles[k + 1 :]])

    def save(self, path: str | Path) -> None:
        """Write the scene to a file in JSON, or in YAML (.yaml, .yml) where PyYAML is installed."""
        scene_file.write(path, {each.name: getattr(self, each.name) for each in dataclasses.fields(self)})

    @classmethod
    def load(cls, path: str | Path) -> Scene:
        """Read a scene that :meth:`save` or a user has written; fields left out have their defaults.

        Raises:
            ConfigError: the file is not a scene, or names the field, the value and what is admissible.
        """
        return cls.from_fields(scene_file.read(path))

    def to_mjcf(
        self,
        robot: Robot | None = None,
        controller: PD | None = None,
        start: Start | None = None,
        gait: Gait | None = None,
        step: float = 0.001,
    ) -> str:
        """Robot and scene as a model of MuJoCo in 3D, an MJCF document for ``mujoco.MjModel.from_xml_string``.

        Links are capsules ``link_1`` to ``link_n`` on a free joint. Joints are the hinges ``yaw_i`` and ``pitch_i``
        with position servos of the same names. The keyframe "start" has the robot at its start. Broken joints have no
        servo; springs hold the locked ones, which need the integrator and at most the time step of the document.
        Contacts are those of MuJoCo, which are soft. Friction along and across a link is that of explicit pairs with
        the ground. Rolling friction of links and the torque-speed line of a motor are left out, with a warning. That of
        spheres is a moment at the contact. Pipes, height fields that go below the plane, and friction of a field by
        cell are refused.

        Args:
            robot: default Aiko.
            controller: gains and torque limit of the servos; default those of the environments.
            start: where link 1 starts, and the posture.
            gait: the posture "gait" is its reference at t = 0; default lateral undulation.
            step: of the time stepping [s], > 0.

        Raises:
            ConfigError: names what the model cannot have, such as backlash and friction that depends on speed.
        """
        controller = PD(**_SERVO) if controller is None else controller
        if not isinstance(controller, PD):
            raise ConfigError("controller", repr(controller), "a snake_env.PD for MuJoCo")
        # Starts know scenes, so that their class is not known here.
        if start is not None and getattr(start, "_section", None) != "start":
            raise ConfigError("start", repr(start), "a snake_env.Start")
        return mjcf.write(self, Robot.of(robot), controller, start, Gait.of(gait), _checks.positive("step", step))

    @classmethod
    def from_fields(cls, fields: Mapping[str, Any]) -> Scene:
        """A scene from some of its fields, as a file has them; the others have their defaults.

        Raises:
            ConfigError: names the field, the value and what is admissible.
        """
        if not isinstance(fields, Mapping):
            raise ConfigError("scene", repr(fields), "a mapping of field names to values")
        return cls.of(fields)

    def with_obstacles_at(self, position: Any, angle: Any = None, height: Any = None) -> Scene:
        """The scene with the k obstacles that can be pushed at (k, 2) [m], turned by (k,) [rad] from where they are.

        Centres of spheres are put to the heights in (k,) [m], if given. ``obstacle_position``, ``obstacle_angle`` and
        ``obstacle_height`` of a state or of a sample of a run are these numbers.

        Raises:
            ConfigError: names the argument that has not one entry for each of the k.
        """
        if len(position) == 0:
            return self
        count = sum(map(is_movable, self.obstacles))
        for name, value, shape in (
            ("position", position, (count, 2)),
            ("angle", angle, (count,)),
            ("height", height, (count,)),
        ):
            if value is not None and np.shape(value) != shape:
                raise ConfigError(name, f"an array {np.shape(value)}", f"{shape}, one for each that can be pushed")
        return dataclasses.replace(self, obstacles=placed(self.obstacles, position, angle, height))

    def _index(self, j: int) -> int:
        return _checks.integer("obstacle", j, 1, len(self.obstacles)) - 1


def course(name: str) -> dict[str, Any]:
    """Obstacles and starts of a course of the thesis."""
    known = courses()
    if not isinstance(name, str) or name not in known:
        raise ConfigError("preset", repr(name), "one of " + ", ".join(f'"{key}"' for key in known))
    return known[name]
