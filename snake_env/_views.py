"""The pictures of an environment; pygame is imported when the first one is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snake_env.config import Scene
from snake_env.picture import Picture
from snake_env.state import State

if TYPE_CHECKING:
    from snake_env.rendering import TopView, Trail, Window

RENDER_MODES = ["human", "rgb_array"]


def frame_rate(control_period: float) -> int:
    """Images per second at which a video runs in real time."""
    return max(1, round(1.0 / control_period))


class Views:
    """One canvas for all robots and a window, made when the first picture is drawn; robots have trails of their own."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture
        self._canvas: TopView | None = None
        self._window: Window | None = None
        self._trails: dict[int, Trail] = {}

    def image(self, i: int, state: State, scene: Scene) -> NDArray[np.uint8]:
        """Picture of robot ``i`` (height, width, 3)."""
        return self._open(state).image(state, scene, self._trail(i))

    def show(self, state: State, scene: Scene, frames_per_second: int) -> None:
        """Shows robot 0 in a window, in real time."""
        from snake_env.rendering import Window

        self._window = self._window or Window()
        canvas = self._open(state)
        self._window.show(canvas.draw(state, scene, self._trail(0)), frames_per_second)
        canvas.zoom(self._window.zoomed)

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()
        self._canvas = None
        self._trails.clear()

    def __getstate__(self) -> dict[str, Any]:
        """Pictures are not part of what is pickled or copied."""
        return {"_picture": self._picture, "_canvas": None, "_window": None, "_trails": {}}

    def _open(self, state: State) -> TopView:
        if self._canvas is None:
            self._canvas = _new_canvas(state.link_quaternion is not None, self._picture)
        return self._canvas

    def _trail(self, i: int) -> Trail:
        from snake_env.rendering import Trail

        return self._trails.setdefault(i, Trail())


def _new_canvas(is_spatial: bool, picture: Picture) -> TopView:
    if is_spatial:
        from snake_env.side_view import TwoViews

        return TwoViews(picture)
    from snake_env.rendering import TopView

    return TopView(picture)
