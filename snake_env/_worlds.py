"""Where episodes take place: scenes, starts and goals of the user's own, for all robots or robot by robot."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from snake_env import _checks
from snake_env.config import Scene, Start
from snake_env.errors import ConfigError
from snake_env.obstacles import Circle
from snake_env.state import State

Generator = Callable[[np.random.Generator, float], Scene]
World = dict[str, Any]

SCENE = "a snake_env.Scene, a list of them, the path of a scene file, or a function generator(rng, difficulty)"
GOAL = "the distance of a goal line [m], a goal point (x, y) or (x, y, radius), a path [(x, y), ...], or a mapping"
PRESCRIBED = "scene, start or goal, in which obstacles have friction of their own"
ROUGH = 1
"""Sets the random numbers of the pegs' friction apart from those of a generator of scenes."""
OPTIONS = ("scene", "start", "goal")
"""Options of a reset that prescribe where the episodes it begins take place."""


class Worlds:
    """What is prescribed for the episodes of an environment instead of drawn by the task's family of scenes.

    Args:
        scene: see ``SCENE``; one of a list is drawn for each episode.
        start: where link 1 starts; by default on a preset course there, else at the origin.
        goal: see ``GOAL``.
        model: "planar" or "spatial", for the start on a preset course.
        peg_friction: interval of the Coulomb coefficient of drawn pegs, or None.

    Attributes:
        scene: one of the scenes, for the ground that all share, or None.
        is_prescribed: whether anything is.
    """

    def __init__(
        self,
        scene: Any = None,
        start: Start | Mapping[str, Any] | None = None,
        goal: Any = None,
        model: str = "planar",
        peg_friction: Any = None,
    ) -> None:
        self._generator = _generator_of(scene)
        self._friction = None if peg_friction is None else _interval("peg_friction", peg_friction)
        self._model = model
        self._start, self._goal = start, goal
        first = np.random.default_rng(0)
        self.scene = None if self._generator is None else _generated(self._generator, first, 0.0)
        self.is_prescribed = any(part is not None for part in (scene, start, goal))
        self.has_rough_pegs = self._friction is not None
        if self.is_prescribed and self.has_rough_pegs:
            raise ConfigError("peg_friction", repr(peg_friction), f"None beside {PRESCRIBED}")

    def world(self, episode: tuple[int, int], difficulty: float, options: Mapping[str, Any]) -> World:
        """What is prescribed for one episode.

        Args:
            episode: its seed and number; the generator's random numbers depend on nothing else.
            difficulty: of the robot, in [0, 1].
            options: of the reset that begins it, over those of the environment.
        """
        if self._friction is not None and (prescribed := given(options)):
            raise ConfigError("options", ", ".join(prescribed), f"no {PRESCRIBED} with peg_friction")
        own = options.get("scene")
        generator = self._generator if own is None else _generator_of(own)
        scene = None if generator is None else _generated(generator, np.random.default_rng(episode), difficulty)
        start = options.get("start", self._start)
        if start is None and scene is not None and scene.course is not None:
            start = Start.on_course(scene, self._model)
        goal = _goal_of(options.get("goal", self._goal))
        prescribed = {"scene": scene, "start": start, "goal": goal}
        return {name: part for name, part in prescribed.items() if part is not None}

    def rough(self, episode: tuple[int, int], scene: Scene, state: State) -> World:
        """The world of an episode that has been drawn, its pegs with friction; empty if it has none.

        Args:
            episode: its seed and number, on which the coefficient depends.
            scene: as drawn.
            state: of the robot at its start.
        """
        assert self._friction is not None
        if not any(isinstance(one, tuple) for one in scene.obstacles):
            return {}
        mu = float(np.random.default_rng([*episode, ROUGH]).uniform(*self._friction))
        pegs = [Circle(*one, friction=mu) if isinstance(one, tuple) else one for one in scene.obstacles]
        return {"scene": dataclasses.replace(scene, obstacles=pegs), **_where(state)}


def _interval(field: str, value: Any) -> tuple[float, float]:
    low, high = _pair(field, value)
    if not 0.0 <= low <= high <= 10.0:
        raise ConfigError(field, repr(value), "0 <= low <= high <= 10")
    return low, high


def _where(state: State) -> World:
    """Start and goal of a robot that has not moved."""
    axis = state.link_axis[0]
    start = Start(tuple(state.link_position[0, :2].tolist()), float(np.arctan2(axis[1], axis[0])))
    x, y = state.goal.tolist()
    if state.goal_radius > 0.0:
        return {"start": start, "goal": {"point": [x, y], "radius": float(state.goal_radius)}}
    return {"start": start, "goal": {"distance": x - float(state.position[0]), "centre_line": y}}


def given(options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that prescribe where episodes take place, without those that are None."""
    return {name: options[name] for name in OPTIONS if options.get(name) is not None}


def per_robot(options: Mapping[str, Any], num_envs: int) -> list[dict[str, Any]]:
    """The options of each robot; a list has one entry per robot, None where a robot has none."""
    lists: dict[str, Any] = {}
    for name, value in given(options).items():
        if name == "scene" and not isinstance(value, list):
            value = _generator_of(value)  # a file is read once
        lists[name] = value if isinstance(value, list) else [value] * num_envs
        if len(lists[name]) != num_envs:
            expected = f"a list of {num_envs}, or one for all; a point is a tuple, a path an array"
            raise ConfigError(f"options[{name!r}]", f"a list of {len(value)}", expected)
    return [given({name: values[i] for name, values in lists.items()}) for i in range(num_envs)]


def _generated(generator: Generator, rng: np.random.Generator, difficulty: float) -> Scene:
    """A scene of the user's generator."""
    scene = generator(rng, difficulty)
    if not isinstance(scene, Scene):
        raise ConfigError("scene", f"a generator that returned {scene!r}", "a generator of snake_env.Scene")
    return scene


def _generator_of(scene: Any) -> Generator | None:
    if scene is None or callable(scene):
        return scene
    scenes = [_scene_of(one) for one in (scene if isinstance(scene, list | tuple) else [scene])]
    if not scenes:
        raise ConfigError("scene", "[]", SCENE)
    return Choice(scenes)


class Choice:
    """Generator that draws one of some scenes."""

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self._scenes = scenes

    def __call__(self, rng: np.random.Generator, difficulty: float) -> Scene:
        return self._scenes[int(rng.integers(len(self._scenes)))]


def _scene_of(scene: Any) -> Scene:
    if isinstance(scene, str | Path):
        return Scene.load(scene)
    if isinstance(scene, Mapping):
        return Scene.from_fields(scene)
    if not isinstance(scene, Scene):
        raise ConfigError("scene", repr(scene), SCENE)
    return scene


def _goal_of(goal: Any) -> dict[str, Any] | None:
    """The goal as the core has it."""
    if isinstance(goal, np.ndarray | np.generic):
        goal = goal.tolist()
    if goal is None:
        return None
    if isinstance(goal, Mapping):
        return dict(goal)
    if _is_path(goal):
        return {"path": [list(_pair(f"goal[{k}]", point)) for k, point in enumerate(goal)]}
    if isinstance(goal, list | tuple) and len(goal) in (2, 3):
        x, y, *radius = _checks.reals("goal", goal, GOAL).tolist()
        return {"point": [x, y]} | ({"radius": radius[0]} if radius else {})
    if isinstance(goal, int | float) and not isinstance(goal, bool):
        return {"distance": float(goal)}
    raise ConfigError("goal", repr(goal), GOAL)


def _is_path(goal: Any) -> bool:
    """Whether it is a sequence of points."""
    return isinstance(goal, list | tuple) and len(goal) > 0 and isinstance(goal[0], list | tuple | np.ndarray)


def _pair(field: str, value: Any) -> tuple[float, float]:
    numbers = _checks.reals(field, value, "two numbers")
    if numbers.shape != (2,):
        raise ConfigError(field, repr(value), "two numbers")
    x, y = numbers.tolist()
    return x, y


def split(options: Mapping[str, Any]) -> tuple[Worlds, dict[str, Any]]:
    """The worlds that an environment's keywords describe, and the configuration that is left for the core."""
    rest = dict(options)
    if (corridor := rest.pop("corridor", None)) is not None:
        _accept_corridor(corridor, rest)
    if (peg_friction := rest.pop("peg_friction", None)) is not None:
        rest["start_jitter"] = 0.0  # a start that is prescribed has the gait's posture at phase zero
    prescribed = {name: rest.pop(name, None) for name in OPTIONS}
    worlds = Worlds(**prescribed, model=rest.get("model", "planar"), peg_friction=peg_friction)
    if worlds.scene is not None:
        for name in ("friction", "friction_backward", "stribeck", "slope"):
            if rest.get(name) is not None:
                raise ConfigError(name, repr(rest[name]), "None beside a scene, which has a ground of its own")
        rest["scene"] = worlds.scene
    return worlds, rest


def _accept_corridor(corridor: Any, options: dict[str, Any]) -> None:
    """The deprecated option (y of the centre line, half width) as the options that have taken its place."""
    centre_line, options["corridor_half_width"] = _pair("corridor", corridor)
    instead = 'corridor_half_width and goal={"centre_line": y}'
    warnings.warn(f"corridor=(y, half width) is {instead} now", DeprecationWarning, stacklevel=5)
    goal = _goal_of(options.get("goal")) or {}
    if not goal.keys() & {"point", "path", "heading", "centre_line"}:
        options["goal"] = {**goal, "centre_line": centre_line}


def check_options(options: Mapping[str, Any] | None, known: Sequence[str]) -> Mapping[str, Any]:
    """Options of a reset, ``known`` beside those of worlds and difficulty."""
    return _checks.options(options, [*known, *OPTIONS, "difficulty"])
