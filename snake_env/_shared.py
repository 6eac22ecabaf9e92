"""What the single environment and the batch have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env import _checks, _worlds
from snake_env._robots import Options, Robots
from snake_env._task import BATCH_KEYWORDS
from snake_env._views import RENDER_MODES, Views, frame_rate
from snake_env.options import TaskOptions
from snake_env.picture import Picture

FIXED = frozenset([*TaskOptions.__annotations__, *BATCH_KEYWORDS]) - {"difficulty", "render_mode", "num_envs"}
"""Keywords that cannot be set as attributes: nothing would read them."""
GUARDED = FIXED | {"render_mode", "spec"}
"""Attributes that :meth:`RobotsEnvironment.__setattr__` looks at."""


class RobotsEnvironment:
    """Robots in the core, their task and their pictures."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": RENDER_MODES, "render_fps": 20}
    _ready = False

    def _set_up(self, robots: Robots, render_mode: str | None, picture: Any = None) -> None:
        """Takes over the robots."""
        self.render_mode = render_mode
        self._robots = robots
        self._views = Views(Picture.of(picture))
        self.metadata = {**self.metadata, "render_fps": frame_rate(robots.task.control_period)}  # type: ignore[misc]

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuses what would be ignored, and a render mode that is none; a spec keeps no NumPy values, which JSON has
        none of.
        """
        if name in GUARDED:
            if name in FIXED:
                raise AttributeError(f"{name} is fixed when the environment is made")
            if name == "spec":
                value = value and replace(value, kwargs=_checks.plain(value.kwargs))
            else:
                _checks.choice(name, value, [None, *RENDER_MODES])
        super().__setattr__(name, value)

    @property
    def _needs_reset(self) -> bool:
        """Before the first reset, and after a call that a signal handler has ended."""
        return not self._ready or self._robots.native.is_interrupted

    @property
    def control_period(self) -> float:
        """Simulated time of one step [s]."""
        return self._robots.task.control_period

    @property
    def layout(self) -> dict[str, Any]:
        """What each element of observation, action and info means; see ``docs/environments.md``."""
        return self._robots.task.layout

    def _observed(self, observation: NDArray[np.float32]) -> Any:
        """Flat observations as the observation space has them."""
        return self._robots.task.observed(observation)

    def _options(self, options: Mapping[str, Any] | None, known: Sequence[str] = ()) -> Options:
        """The options of a reset, ``known`` beside those of worlds and difficulty."""
        checked = _worlds.check_options(options, known)
        if not checked:
            return Options()
        prescribed = self._prescribed(checked)
        return Options(prescribed if any(prescribed) else None, checked.get("difficulty"))

    def _prescribed(self, options: Mapping[str, Any]) -> list[dict[str, Any]]:
        """What the options prescribe for each robot."""
        return _worlds.per_robot(options, self._robots.num_envs)

    def _images(self, robots: Sequence[int]) -> list[NDArray[np.uint8]] | None:
        """The images of some robots ("rgb_array"); None otherwise."""
        if self.render_mode is None:
            gym.logger.warn("render needs a render_mode: pass it when the environment is made")
            return None
        if self.render_mode == "human":
            if 0 in robots:  # asked of each robot in turn, the window is drawn once
                self._show()
            return None
        return [self._views.image(i, self._robots.state([i]).robot(0), self._robots.scene(i)) for i in robots]

    def _show(self) -> None:
        """Draws robot 0 in the window, if there is one."""
        if self.render_mode == "human":
            state, scene = self._robots.state([0]).robot(0), self._robots.scene(0)
            self._views.show(state, scene, self.metadata["render_fps"])
