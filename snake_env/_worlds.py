"""Where episodes take place: scenes, starts and goals of the user's own, for all robots or robot by robot."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from snake_env import _checks
from snake_env.config import Scene, Start
from snake_env.errors import ConfigError

Generator = Callable[[np.random.Generator, float], Scene]
World = dict[str, Any]

SCENE = "a snake_env.Scene, a list of them, the path of a scene file, or a function generator(rng, difficulty)"
GOAL = "the distance of a goal line [m], a goal point (x, y) or (x, y, radius), a path [(x, y), ...], or a mapping"
OPTIONS = ("scene", "start", "goal")
"""Options of a reset that prescribe where the episodes it begins take place."""


class Worlds:
    """What is prescribed for the episodes of an environment instead of drawn by the task's family of scenes.

    Args:
        scene: see ``SCENE``; one of a list is drawn for each episode.
        start: where link 1 starts; by default on a preset course there, else at the origin.
        goal: see ``GOAL``.
        model: "planar" or "spatial", for the start on a preset course.

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
    ) -> None:
        self._generator = _generator_of(scene)
        self._model = model
        self._start, self._goal = start, goal
        first = np.random.default_rng(0)
        self.scene = None if self._generator is None else _generated(self._generator, first, 0.0)
        self.is_prescribed = any(part is not None for part in (scene, start, goal))

    def world(self, episode: tuple[int, int], difficulty: float, options: Mapping[str, Any]) -> World:
        """What is prescribed for one episode.

        Args:
            episode: its seed and number; the generator's random numbers depend on nothing else.
            difficulty: of the robot, in [0, 1].
            options: of the reset that begins it, over those of the environment.
        """
        own = options.get("scene")
        generator = self._generator if own is None else _generator_of(own)
        scene = None if generator is None else _generated(generator, np.random.default_rng(episode), difficulty)
        start = options.get("start", self._start)
        if start is None and scene is not None and scene.course is not None:
            start = Start.on_course(scene, self._model)
        goal = _goal_of(options.get("goal", self._goal))
        prescribed = {"scene": scene, "start": start, "goal": goal}
        return {name: part for name, part in prescribed.items() if part is not None}


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
    worlds = Worlds(**{name: rest.pop(name, None) for name in OPTIONS}, model=rest.get("model", "planar"))
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
