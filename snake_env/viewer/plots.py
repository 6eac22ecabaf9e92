"""Plots beside the scene: joint angles, joint torques, contact forces over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.viewer.frames import Frames

with extras():
    from viser import uplot

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
SHOWN = 4
"""Joints or links in a plot, evenly along the robot."""


class Plots:
    """Three plots in a folder of the page.

    Args:
        gui: of a server.
    """

    def __init__(self, gui: Any) -> None:
        self._gui = gui
        self._plots: dict[str, Any] = {}

    def show(self, frames: Frames) -> None:
        """Draws all frames."""
        rows = {
            "joint angle [deg]": np.degrees(frames.joint_angle),
            "joint torque [N m]": frames.joint_torque,
            "contact force [N]": np.linalg.norm(frames.force, axis=-1),
        }
        for title, values in rows.items():
            chosen = np.unique(np.linspace(0, values.shape[1] - 1, SHOWN).round().astype(int))
            data = (frames.time, *(np.ascontiguousarray(values[:, k]) for k in chosen))
            if title in self._plots:
                self._plots[title].data = data
            else:
                self._plots[title] = self._gui.add_uplot(
                    data, _series(title, chosen), title=title, scales={"x": uplot.Scale(time=False)}, aspect=1.6
                )


def _series(title: str, chosen: NDArray[np.int64]) -> tuple[Any, ...]:
    word = "link" if "contact" in title else "joint"
    lines = [uplot.Series(label=f"{word} {k + 1}", stroke=COLOURS[i], width=1) for i, k in enumerate(chosen)]
    return (uplot.Series(label="time [s]"), *lines)
