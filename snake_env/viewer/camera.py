"""The camera of the page: the first view, and one that follows the robot."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from snake_env.viewer.controls import checkbox, place
from snake_env.viewer.frames import Frames

SETTLES = 2.0
"""How long a page that has just opened may still report the view that it had before its first one [s]."""


def look_at(made: Any, frames: Frames) -> None:
    """The first view: from behind and above, the whole path in the picture."""
    flat = frames.position.reshape(-1, 3)
    middle, size = flat.mean(axis=0), max(1.2, float(np.ptp(flat[:, :2], axis=0).max()))
    made.initial_camera.position = middle + size * np.array([-0.25, -0.65, 0.65])
    made.initial_camera.look_at = middle


class Follower:
    """A checkbox of the page; while it is set, the cameras of all open pages look at the robot.

    Direction and distance remain as the reader has chosen them.

    Args:
        made: the viser server.
        initial: whether it is set.
    """

    def __init__(self, made: Any, initial: bool) -> None:
        self._server = made
        self._opened: dict[int, float] = {}
        self.following = checkbox(made.gui, "follow the robot", initial)

    def show(self, frames: Frames, k: int) -> None:
        """Points the cameras at the middle of the robot.

        Args:
            frames: poses.
            k: of the present pose.
        """
        if not self.following.value:
            return
        middle, now, first = frames.position[k].mean(axis=0), time.monotonic(), self._server.initial_camera
        for number, client in self._server.get_clients().items():
            camera = client.camera
            settles = now - self._opened.setdefault(number, now) < SETTLES
            position, looked_at = (place(value) for value in _view(first if settles else camera))
            if position is None or looked_at is None:
                continue
            # What a page reports may be late, but its distance from where it looks is not changed by following.
            offset = position - looked_at
            with client.atomic():
                camera.position = middle + offset
                camera.look_at = middle


def _view(camera: Any) -> tuple[Any, Any]:
    """From where a camera looks, and where to."""
    return camera.position, camera.look_at
