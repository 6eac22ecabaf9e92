"""The camera of the page: the first view, and one that follows the robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from snake_env.viewer.controls import checkbox, place
from snake_env.viewer.frames import Frames


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
        self.following = checkbox(made.gui, "follow the robot", initial)

    def show(self, frames: Frames, k: int) -> None:
        """Points the cameras at the middle of the robot.

        Args:
            frames: poses.
            k: of the present pose.
        """
        if not self.following.value:
            return
        middle = frames.position[k].mean(axis=0)
        for client in self._server.get_clients().values():
            camera = client.camera
            position, looked_at = place(camera.position), place(camera.look_at)
            if position is None or looked_at is None:
                continue
            # What a page reports may be late, but its distance from where it looks is not changed by following.
            offset = position - looked_at
            with client.atomic():
                camera.position = middle + offset
                camera.look_at = middle
