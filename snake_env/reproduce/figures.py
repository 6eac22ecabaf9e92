"""The pictures of chapter 7, named as in the thesis: here those of the planar model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from snake_env import drawing
from snake_env.reproduce import figures_2_3, figures_5_3, figures_6_3, figures_7_3_5, figures_spatial
from snake_env.reproduce.experiment import AIKO, Runs
from snake_env.reproduce.measures import MIDDLE, at, between, mean_force

Line = dict[str, Any]
PLANAR: Line = {"color": drawing.PATH}
SPATIAL: Line = {"color": drawing.FORCE, "linestyle": "--"}
ORTHOTROPIC: Line = {"color": drawing.LINKS[10]}
FREE: Line = {"color": drawing.PEG}
"""How curves are drawn, by model and ground."""
SHOWN = 5.2
"""Time of the outline in Fig. 7.7 (a) [s]."""
COURSE = (-0.1, 3.3), (-0.2, 0.5)
"""The ground shown of a course [m]."""


def figure_7_6(runs: Runs, path: Path) -> Path:
    """Position of link 6 on the course of Table 7.3, both models."""
    drawn, axes = drawing.figure(2, 1, 7.0, 4.6)
    _course(axes[0, 0], runs, "table 7.3", "(a) path of link 6, pegs of Table 7.3 to scale")
    _path(axes[0, 0], runs, "table 7.3, 3D", SPATIAL)
    _position_over_time(axes[1, 0], runs, _both("table 7.3"), "(b) forward position of link 6")
    return drawing.save(drawn, path)


def figure_7_7(runs: Runs, path: Path) -> Path:
    """Outline at t = 5.2 s with contact forces, and the forces on links 2, 7 and 10 around that time."""
    run, scene = runs["table 7.3"], runs.experiment("table 7.3").scene
    drawn, axes = drawing.figure(3, 1, 7.0, 8.0)
    shown = at(run, SHOWN)
    drawing.pegs(axes[0, 0], scene)
    drawing.body(axes[0, 0], AIKO, run.position[shown], run.angle[shown], numbered=(1, 2, 7, 10, 11))
    drawing.forces(axes[0, 0], run.position[shown], mean_force(run, SHOWN - 0.05, SHOWN + 0.05))
    title = f"(a) t = {SHOWN} s; red: forces of the pegs, black: their sum ({drawing.FORCE_SCALE:g} m/N)"
    drawing.ground(axes[0, 0], title, x=(0.6, 2.1), y=(-0.12, 0.32))
    _forces_over_time(axes[1, 0], runs, 0, "(b) forward component; the spikes of collisions are cut off")
    _forces_over_time(axes[2, 0], runs, 1, "(c) lateral component, positive to the left")
    return drawing.save(drawn, path)


def _forces_over_time(axes: Axes, runs: Runs, component: int, title: str, limit: float = 40.0) -> None:
    run = runs["table 7.3"]
    times = between(run, 4.5, 5.5)
    for link, colour in drawing.LINKS.items():
        force = run.contact_force[times, link - 1, component]
        axes.plot(run.time[times], force, color=colour, label=f"link {link}")
    axes.axvline(SHOWN, color="black", linewidth=0.6, linestyle=":")
    axes.set(title=title, xlabel="time [s]", ylabel=f"F_{'xy'[component]} [N]")
    axes.set(xlim=(4.5, 5.5), ylim=(-limit, limit))
    axes.legend(ncols=3, loc="upper right")


def figure_7_8(runs: Runs, path: Path) -> Path:
    """Position of link 6 for 15 s with peg 3 moved and removed."""
    drawn, axes = drawing.figure(2, 1, 7.0, 4.8)
    _course(axes[0, 0], runs, "peg 3 moved", "(a) path of link 6 in 15 s, peg 3 moved by 2 L_SC to the left")
    drawing.pegs(axes[1, 0], runs.experiment("table 7.3").scene, removed=3)
    _path(axes[1, 0], runs, "peg 3 removed")
    drawing.ground(axes[1, 0], "(b) path of link 6 in 15 s, peg 3 removed", *COURSE)
    return drawing.save(drawn, path)


def figure_7_9(runs: Runs, path: Path) -> Path:
    """Posture at t = 0 for two other phase shifts, with pegs placed for them, and the middle link's path."""
    drawn, axes = drawing.figure(2, 1, 7.0, 6.0)
    for i, beta in enumerate((-30, -70)):
        name = f"beta {beta}"
        run = runs[name]
        drawing.pegs(axes[i, 0], runs.experiment(name).scene)
        drawing.body(axes[i, 0], AIKO, run.position[0], run.angle[0])
        walk = run.position[: at(run, 5.0) + 1, MIDDLE]
        axes[i, 0].plot(*walk.T, color=drawing.FORCE, linestyle="--", label="link 6, t = 0 to 5 s")
        title = f"({'ab'[i]}) beta_h = {beta} deg, posture at t = 0"
        drawing.ground(axes[i, 0], title, x=(-1.3, 1.1), y=(-0.4, 0.4))
        axes[i, 0].legend(loc="lower right")
    return drawing.save(drawn, path)


def figure_7_14(runs: Runs, path: Path) -> Path:
    """Position of link 6 on open ground with isotropic friction, both models."""
    drawn, axes = drawing.figure(1, 2, 7.0, 3.2)
    _path(axes[0, 0], runs, "free")
    _path(axes[0, 0], runs, "free, 3D", SPATIAL)
    drawing.ground(axes[0, 0], "(a) path of link 6, isotropic friction", x=(-0.17, 0.13), y=(-0.2, 0.2))
    _position_over_time(axes[0, 1], runs, _both("free"), "(b) forward position of link 6")
    return drawing.save(drawn, path)


def figure_7_16(runs: Runs, path: Path) -> Path:
    """Position of link 6 on the course of Table 7.5, both models, and without pegs."""
    drawn, axes = drawing.figure(2, 1, 7.0, 4.8)
    _course(axes[0, 0], runs, "table 7.5", "(a) path of link 6, pegs of Table 7.5 to scale")
    _path(axes[0, 0], runs, "table 7.5, 3D", SPATIAL)
    curves = {
        **_both("table 7.5"),
        "2D, no pegs, (0.2, 0.5)": ("orthotropic", ORTHOTROPIC),
        "2D, no pegs, (0.2, 0.2)": ("free", FREE),
    }
    _position_over_time(axes[1, 0], runs, curves, "(b) forward position of link 6")
    return drawing.save(drawn, path)


FIGURES: dict[str, tuple[str, Callable[[Runs, Path], Path]]] = {
    **figures_2_3.FIGURES,
    **figures_5_3.FIGURES,
    **figures_6_3.FIGURES,
    **figures_spatial.FIGURES,
    "figure-7.6.png": ("7.3.4", figure_7_6),
    "figure-7.7.png": ("7.3.4", figure_7_7),
    "figure-7.8.png": ("7.3.4", figure_7_8),
    "figure-7.9.png": ("7.3.4", figure_7_9),
    **figures_7_3_5.FIGURES,
    "figure-7.14.png": ("7.5.2", figure_7_14),
    "figure-7.16.png": ("7.5.3", figure_7_16),
}
"""File name -> section and function."""


def write(runs: Runs, folder: Path, sections: tuple[str, ...]) -> list[Path]:
    """Draws the figures of some sections."""
    folder.mkdir(parents=True, exist_ok=True)
    chosen = [(name, draw) for name, (section, draw) in FIGURES.items() if section in sections]
    with drawing.style():
        return [draw(runs, folder / name) for name, draw in chosen]


def _course(axes: Axes, runs: Runs, name: str, title: str) -> None:
    drawing.pegs(axes, runs.experiment(name).scene)
    _path(axes, runs, name)
    drawing.ground(axes, title, *COURSE)


def _path(axes: Axes, runs: Runs, name: str, line: Line = PLANAR) -> None:
    """Path of link 6, its start as a dot."""
    walk = runs[name].position[:, MIDDLE, :2]
    axes.plot(*walk.T, **line)
    axes.plot(*walk[0], "o", color=line["color"], markersize=4)


def _both(name: str) -> dict[str, tuple[str, Line]]:
    """An experiment with both models."""
    return {"2D": (name, PLANAR), "3D": (f"{name}, 3D", SPATIAL)}


def _position_over_time(axes: Axes, runs: Runs, curves: dict[str, tuple[str, Line]], title: str) -> None:
    """Forward displacement of link 6 in the experiments ``curves[label][0]``."""
    for label, (name, line) in curves.items():
        x = runs[name].position[:, MIDDLE, 0]
        axes.plot(runs[name].time, x - x[0], label=label, **line)
    axes.set(title=title, xlabel="time [s]", ylabel="x - x(0) [m]")
    axes.legend()
