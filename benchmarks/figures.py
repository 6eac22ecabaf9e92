"""Pictures of a run: work-precision scene by scene, and growth."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter

from benchmarks import curves
from benchmarks.curves import Point
from benchmarks.results import Record, Results
from snake_env import drawing

OURS, ALONE, PEER, THESIS, VARIANT = "#1f5fa8", "#6ea0d8", "#c0272d", "#8a8f98", "#cfd6de"
PREFIX = "bench-"


def draw_all(results: Results, folder: Path) -> list[Path]:
    """Draws what has been measured; one picture a scene, and one of growth.

    Args:
        results: of a run.
        folder: where the pictures go.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scenes = [scene for scene in results.of("scene") if results.of("point", scene=scene["scene"])]
    drawn = [work_precision(results, scene, folder) for scene in scenes]
    if results.of("growth"):
        drawn.append(growth(results, folder))
    return drawn


def work_precision(results: Results, scene: Record, folder: Path) -> Path:
    """Speed over error, both logarithmic: up and to the left is better."""
    name = scene["scene"]
    ours = curves.points(results, name, curves.OURS, "speed_fleet")
    with drawing.style():
        picture, axes = drawing.figure(1, 1, 8.0, 4.2)
        one = axes[0, 0]
        _dots(one, ours, VARIANT, "all our settings")
        _line(one, curves.frontier(ours), OURS, "ours, in registers")
        _line(one, curves.frontier(curves.points(results, name, curves.OURS, "speed_alone")), ALONE, "ours, one robot")
        _line(one, curves.frontier(curves.points(results, name, curves.THESIS)), THESIS, "Algorithm 3.1, same code")
        _line(one, curves.frontier(curves.points(results, name, "MuJoCo")), PEER, "MuJoCo, best of its settings")
        one.set(
            xscale="log",
            yscale="log",
            xlabel=f"largest distance of a link from the converged run in {scene['scenario']['duration']:g} s [mm]",
        )
        one.set(ylabel="simulated seconds per second, one thread", title=scene["title"])
        _plain_numbers(one)
        one.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
        return drawing.save(picture, folder / f"{PREFIX}{name}.png")


def _dots(axes: Axes, points: Iterable[Point], colour: str, label: str) -> None:
    pairs = [(1e3 * p.error, p.speed) for p in points]
    if pairs:
        axes.plot(*zip(*pairs, strict=True), ".", color=colour, markersize=4, label=label)


def _line(axes: Axes, points: list[Point], colour: str, label: str) -> None:
    if points:
        errors = [1e3 * p.error for p in points]
        axes.plot(errors, [p.speed for p in points], "o-", color=colour, markersize=3.5, label=label)


def _plain_numbers(axes: Axes) -> None:
    """Ticks of logarithmic axes as 0.1, 100, 10,000 instead of powers of ten."""
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
            axis.set_minor_formatter(NullFormatter())


def growth(results: Results, folder: Path) -> Path:
    """Links, pegs in the field, and robots with threads."""
    with drawing.style():
        picture, axes = drawing.figure(1, 3, 10.0, 3.2)
        links, pegs, batch = axes[0]
        for scene, colour in (("free", OURS), ("track", PEER)):
            _growth_line(links, results.of("growth", axis="links", scene=scene), "links", "us_per_link", colour, scene)
        links.set(xlabel="links", ylabel="CPU time per link and step [us]", title="links, default method")
        _growth_line(pegs, results.of("growth", axis="pegs"), "pegs", "us_per_step", OURS, "Table 7.5 among far pegs")
        pegs.set(xlabel="pegs in the field", ylabel="CPU time per step [us]", title="pegs out of reach")
        for env, colour in (("SnakeCourse-v1", OURS), ("SnakeField-v1", PEER)):
            for threads, style in ((1, "o-"), (2, "s--")):
                rows = results.of("growth", axis="batch", env=env, actions="gait", threads=threads)
                label = f"{env}, {threads} thread{'s' * (threads > 1)}"
                _growth_line(batch, rows, "robots", "steps_per_second", colour, label, style)
        batch.set(xlabel="robots", ylabel="environment steps per second", title="batch, thesis gait")
        for one in axes[0]:
            one.set(xscale="log")
            one.set_ylim(0.0, 1.3 * one.get_ylim()[1])
            one.legend(fontsize=6, loc="upper left")
            _plain_numbers(one)
        return drawing.save(picture, folder / f"{PREFIX}growth.png")


def _growth_line(axes: Axes, records: list[Record], x: str, y: str, colour: str, label: str, style: str = "o-") -> None:
    rows = sorted(records, key=lambda r: r[x])
    if rows:
        axes.plot([r[x] for r in rows], [r[y] for r in rows], style, color=colour, markersize=3.5, label=label)
