"""Parts of the pictures: style, pegs and bodies to scale, force arrows."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env._files import replace
from snake_env.config import Robot, Scene
from snake_env.obstacles import circles

with extras():
    import matplotlib as mpl
    from cycler import cycler
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, FancyArrowPatch, Polygon

Array = NDArray[np.float64]

# Of Okabe and Ito, told apart by readers with any kind of colour vision.
CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
STYLE: dict[str, Any] = {
    "axes.prop_cycle": cycler(color=CYCLE),
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "figure.constrained_layout.use": True,
}
PATH = "#1f5fa8"
BODY = "#dfe9df"
OUTLINE = "#4b6b55"
PEG = "#9aa0a8"
FORCE = "#c0272d"
LINKS = {2: "#1f5fa8", 7: "#c0272d", 10: "#3a8f4d"}
"""Colours of the links whose forces are plotted."""
FORCE_SCALE = 0.012
"""Length of a force arrow [m/N]."""
FORCE_SHOWN = 0.1
"""Forces below this have no arrow [N]."""
SUM_SHOWN = 0.5
"""The same for their sum, which would be all head [N]."""


def style() -> AbstractContextManager[None]:
    """Everything drawn inside looks alike."""
    return mpl.rc_context(STYLE)  # type: ignore[arg-type]


def figure(
    rows: int, columns: int, width: float, height: float, heights: tuple[float, ...] | None = None
) -> tuple[Figure, Array]:
    """A figure of width x height inches and its axes (rows, columns), rows in the ratio of ``heights``."""
    drawn = Figure(figsize=(width, height))
    FigureCanvasAgg(drawn)
    return drawn, drawn.subplots(rows, columns, squeeze=False, height_ratios=heights)


def save(drawn: Figure, path: Path) -> Path:
    """Writes a PNG file."""
    replace(path, lambda part: drawn.savefig(part, dpi=150))
    return path


Limits = tuple[float, float]


def ground(axes: Axes, title: str, x: Limits | None = None, y: Limits | None = None) -> None:
    """A map of the ground between the limits [m], x and y to the same scale."""
    axes.set(title=title, xlabel="x [m]", ylabel="y [m]", xlim=x, ylim=y)
    axes.set_aspect("equal", adjustable="box")


def pegs(axes: Axes, scene: Scene, removed: int | None = None) -> None:
    """The pegs of a scene to scale, numbered from 1 as in the thesis; a removed one is only outlined."""
    for j, (radius, x, y) in enumerate(circles(scene.obstacles), start=1):
        face, line = ("none", ":") if j == removed else (PEG, "-")
        style: dict[str, Any] = {"facecolor": face, "edgecolor": "#50555c", "linewidth": 0.6, "linestyle": line}
        axes.add_patch(Circle((x, y), radius, **style))
        above: dict[str, Any] = {"xytext": (0, 2), "textcoords": "offset points", "ha": "center", "fontsize": 7}
        axes.annotate(str(j), (x, y + radius), **above)


def body(axes: Axes, robot: Robot, position: Array, angle: Array, numbered: tuple[int, ...] = ()) -> None:
    """The links' outlines at one time: CGs (n, 2) [m] and absolute angles (n,) [rad]."""
    shapes = np.broadcast_to(np.stack([robot.contact_half_length, robot.radius], axis=-1), (robot.links, 2))
    shift = np.reshape(robot.cg_offset, (-1, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    for i, middle in enumerate(position + shift):
        outline(axes, stadium(middle, float(angle[i]), *shapes[i]))
        if i + 1 in numbered:
            axes.annotate(str(i + 1), position[i], ha="center", va="center", fontsize=7)


def outline(axes: Axes, corners: Array) -> None:
    """One link from the corners (m, 2) of its outline [m]."""
    axes.add_patch(Polygon(corners, closed=True, facecolor=BODY, edgecolor=OUTLINE, linewidth=0.8))


def stadium(centre: Array, theta: float, half_length: float, radius: float, points: int = 16) -> Array:
    """Corners (m, 2) of a link's outline: straight sides and round ends."""
    end = np.linspace(-0.5 * np.pi, 0.5 * np.pi, points)
    x = np.concatenate([half_length + radius * np.cos(end), -half_length - radius * np.cos(end)])
    y = np.concatenate([radius * np.sin(end), -radius * np.sin(end)])
    cos, sin = np.cos(theta), np.sin(theta)
    return centre + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def forces(axes: Axes, position: Array, force: Array, scale: float = FORCE_SCALE) -> None:
    """Arrows from the links' CGs (n, 2) [m] along the forces (n, 2) [N], and the sum's from the CG of all."""
    for start, vector in zip(position, force, strict=True):
        if np.hypot(*vector) > FORCE_SHOWN:
            _arrow(axes, start, vector, FORCE, 1.2, scale)
    if np.hypot(*force.sum(axis=0)) > SUM_SHOWN:
        _arrow(axes, position.mean(axis=0), force.sum(axis=0), "black", 2.0, scale)


def _arrow(axes: Axes, start: Array, force: Array, colour: str, width: float, scale: float) -> None:
    end = start + scale * force
    shape: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 9, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), color=colour, zorder=4, **shape))
