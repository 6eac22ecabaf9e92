"""What the single environment and the batch have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from snake_env import _checks
from snake_env._robots import Robots
from snake_env._task import Task
from snake_env._views import RENDER_MODES, Views, frame_rate


class RobotsEnvironment:
    """Robots in the core, their task and their pictures.

    Attributes:
        control_period: simulated time of one step [s].
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": RENDER_MODES, "render_fps": 20}
    closed = False
    _ready = False

    def _set_up(self, robots: Robots, render_mode: str | None) -> Task:
        """Takes over the robots; returns their task."""
        self.render_mode = _checks.choice("render_mode", render_mode, [None, *RENDER_MODES])
        self._robots = robots
        self._views = Views()
        self.control_period = robots.task.control_period
        self.metadata = {**self.metadata, "render_fps": frame_rate(self.control_period)}  # type: ignore[misc]
        return robots.task

    @property
    def layout(self) -> dict[str, Any]:
        """What each element of observation, action and info means; see ``docs/environments.md``."""
        return self._robots.task.layout

    def _images(self, robots: Sequence[int]) -> list[NDArray[np.uint8]] | None:
        """The images of some robots ("rgb_array"); None otherwise."""
        self._require_open()
        if self.render_mode is None:
            gym.logger.warn("render needs a render_mode: pass it when the environment is made")
            return None
        if self.render_mode == "human":
            self._show()
            return None
        return [self._views.image(i, self._robots.native.snapshot(i)) for i in robots]

    def _show(self) -> None:
        """Draws robot 0 in the window, if there is one."""
        if self.render_mode == "human":
            self._views.show(self._robots.native.snapshot(0), self.metadata["render_fps"])

    def _require_open(self) -> None:
        if self.closed:
            raise ClosedEnvironmentError("this environment has been closed")
