"""The pictures of an environment; pygame is imported when the first one is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from snake_env.rendering import TopView

RENDER_MODES = ["human", "rgb_array"]


def frame_rate(control_period: float) -> int:
    """Images per second at which a video runs in real time."""
    return max(1, round(1.0 / control_period))


class Views:
    """One view a robot, made when it is first drawn: from above, and in space from the side too."""

    def __init__(self) -> None:
        self._views: dict[int, TopView] = {}

    def image(self, i: int, snapshot: dict[str, Any]) -> NDArray[np.uint8]:
        """Picture of robot ``i`` (height, width, 3)."""
        return self._view(i, snapshot).image(snapshot)

    def show(self, snapshot: dict[str, Any], frames_per_second: int) -> None:
        """Shows robot 0 in a window, in real time."""
        self._view(0, snapshot).show(snapshot, frames_per_second)

    def close(self) -> None:
        """Closes the window, if there is one."""
        for view in self._views.values():
            view.close()
        self._views.clear()

    def __getstate__(self) -> dict[str, Any]:
        """Pictures are not part of what is pickled or copied."""
        return {"_views": {}}

    def _view(self, i: int, snapshot: dict[str, Any]) -> TopView:
        if i not in self._views:
            self._views[i] = _new_view("axis" in snapshot)
        return self._views[i]


def _new_view(in_space: bool) -> TopView:
    if in_space:
        from snake_env.side_view import TwoViews

        return TwoViews()
    from snake_env.rendering import TopView

    return TopView()
