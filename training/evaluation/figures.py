"""Pictures of training and evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import NDArray

from snake_env import Scene, drawing
from snake_env.evaluation.scores import Row
from snake_env.obstacles import circles

COLOURS = ("#8a8f98", "#d98a2b", "#1f5fa8")
"""The thesis's gait, the best gait of the grid, the policy."""


def learning_curve(curve: list[dict[str, Any]], gaits: dict[str, Row], path: Path) -> Path:
    """Success and progress over environment steps, with the scripted gaits as lines."""
    with drawing.style():
        drawn, axes = drawing.figure(1, 2, 7.0, 2.8)
        for one, (key, name, label) in zip(
            axes[0],
            (("is_success", "success", "success rate"), ("distance", "progress", "progress [m]")),
            strict=True,
        ):
            rows = [row for row in curve if key in row]
            steps = [row["steps"] / 1e6 for row in rows]
            one.plot(steps, [row[key] for row in rows], color=COLOURS[-1], label="policy, while it explores")
            for (gait, row), colour in zip(gaits.items(), COLOURS, strict=False):
                one.axhline(row[name].value, color=colour, linestyle="--", label=gait)
            one.set(xlabel="environment steps [million]", ylabel=label, ylim=(0.0, None))
        axes[0, 0].legend(fontsize=7)
        return drawing.save(drawn, path)


def learning_curves(runs: dict[str, list[list[dict[str, Any]]]], path: Path) -> Path:
    """Success, progress and speed over environment steps: median and range over the seeds of each configuration.

    Success has no panel if no episode succeeds, as in runs towards a goal out of reach.

    Args:
        runs: by configuration its seeds' curves, none empty.
        path: of the picture.
    """
    panels = [("is_success", "success rate"), ("distance", "progress [m]"), ("speed", "speed [m/s]")]
    if not any(row.get("is_success") for curves in runs.values() for curve in curves for row in curve):
        del panels[0]
    with drawing.style():
        drawn, axes = drawing.figure(1, len(panels), 3.0 * len(panels), 2.6)
        for one, (key, label) in zip(axes[0], panels, strict=True):
            for number, (name, curves) in enumerate(runs.items()):
                seeds = f"{len(curves)} seeds" if len(curves) > 1 else "1 seed"
                _spread(one, curves, key, f"C{number}", f"{name}, {seeds}")
            one.set(xlabel="environment steps [million]", ylabel=label, xlim=(0.0, None), ylim=(0.0, None))
        axes[0, 0].set_title("median and range over seeds, while they explore", fontsize=7)
        axes[0, -1].legend(loc="lower right", fontsize=6)
        return drawing.save(drawn, path)


def _spread(axes: Axes, curves: list[list[dict[str, Any]]], key: str, colour: str, label: str) -> None:
    """Median and range of one signal, where all curves have begun and none has ended."""
    first, last = max(curve[0]["steps"] for curve in curves), min(curve[-1]["steps"] for curve in curves)
    steps = np.linspace(first, last, 200)
    values = np.array([_on_grid(curve, key, steps) for curve in curves])
    axes.fill_between(steps / 1e6, values.min(axis=0), values.max(axis=0), color=colour, alpha=0.25)
    axes.plot(steps / 1e6, np.median(values, axis=0), color=colour, label=label)


def _on_grid(curve: list[dict[str, Any]], key: str, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """A curve at given steps; before its first finished episode it is at its first value."""
    rows = [row for row in curve if key in row] or [{"steps": 0, key: 0.0}]
    return np.interp(steps, [row["steps"] for row in rows], [row[key] for row in rows])


def comparison(rows: dict[str, Row], path: Path) -> Path:
    """Bars with confidence intervals, one panel per score."""
    panels = (
        ("success", "success rate"),
        ("progress", "progress [m]"),
        ("speed", "speed [m/s]"),
        ("cost_of_transport", "cost of transport"),
    )
    with drawing.style():
        drawn, axes = drawing.figure(1, len(panels), 8.0, 2.8)
        for one, (key, label) in zip(axes[0], panels, strict=True):
            _bars(one, [row[key] for row in rows.values()])
            one.set_xticks(range(len(rows)), [name.replace(" ", "\n") for name in rows], fontsize=7)
            one.set(title=label)
        return drawing.save(drawn, path)


def _bars(axes: Axes, estimates: list[Any]) -> None:
    for k, (value, low, high) in enumerate(estimates):
        if np.isfinite(value):
            spread = np.array([[value - low], [high - value if np.isfinite(high) else 0.0]])
            axes.bar(k, value, color=COLOURS[k % len(COLOURS)], yerr=spread, capsize=3, width=0.65)


def gaits(tried: list[dict[str, float]], progress: NDArray[np.float64], best: dict[str, float], path: Path) -> Path:
    """Mean progress of every gait tried, coloured, over pairs of its parameters; a circle marks the best gait."""
    pairs = (("omega", "amplitude"), ("beta", "amplitude"), ("omega", "beta"))
    units = {"amplitude": "amplitude [deg]", "omega": "omega [deg/s]", "beta": "beta [deg]"}
    with drawing.style():
        drawn, axes = drawing.figure(1, len(pairs), 8.0, 2.7)
        order = np.argsort(progress)
        for one, (x, y) in zip(axes[0], pairs, strict=True):
            places = np.array([[values[x], values[y]] for values in tried])[order]
            image = one.scatter(*places.T, c=progress[order], s=14, cmap="viridis")
            one.plot(best[x], best[y], "o", markersize=12, markerfacecolor="none", markeredgecolor="#c0272d")
            one.set(xlabel=units[x], ylabel=units[y])
        drawn.colorbar(image, ax=list(axes[0]), label="mean progress [m]")
        return drawing.save(drawn, path)


def paths(walks: dict[str, NDArray[np.float64]], scene: Scene, goal: float, path: Path) -> Path:
    """Paths of the robots' CGs (T, 2) [m] through one field; the goal line at x = goal [m]."""
    with drawing.style():
        drawn, axes = drawing.figure(1, 1, 7.0, 3.8)
        one = axes[0, 0]
        for radius, x, y in circles(scene.obstacles):
            one.add_patch(Circle((x, y), radius, facecolor=drawing.PEG, edgecolor="#50555c", linewidth=0.6))
        for (name, walk), colour in zip(walks.items(), COLOURS, strict=False):
            one.plot(*walk.T, color=colour, linewidth=2.0, label=name)
            one.plot(*walk[-1], "o", color=colour, markersize=5)
        one.axvline(goal, color="#3c64b4", linewidth=1.0, linestyle="--")
        drawing.ground(one, "paths of the centre of gravity through one held-out field", (-0.9, 2.5), (-0.9, 0.9))
        one.legend(loc="upper left", fontsize=7, frameon=True, framealpha=0.9)
        return drawing.save(drawn, path)
