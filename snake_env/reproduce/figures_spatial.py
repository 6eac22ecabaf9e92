"""The pictures of the spatial model, named as in the thesis."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from snake_env import drawing
from snake_env.reproduce.checks.drop import SWITCHED_ON
from snake_env.reproduce.experiment import AIKO, PERIOD, Runs
from snake_env.reproduce.experiments import FRICTION_PAIRS, WEAK_GAIN
from snake_env.reproduce.measures import MIDDLE, at
from snake_env.reproduce.measures_spatial import axes as link_axes
from snake_env.reproduce.measures_spatial import vertical_velocity
from snake_env.reproduce.stairs import CASES, experiment_name, flight

COLOURS = (drawing.PATH, drawing.FORCE, drawing.LINKS[10])
"""One for each pair of friction coefficients."""


GAITS = {
    "lateral undulation": "undulation, 3D",
    "sinus-lifting": "lift 0.5",
    "sidewinding": f"sidewinding {FRICTION_PAIRS[0]}",
    "U-shaped rolling": f"rolling {FRICTION_PAIRS[0]}",
    "caterpillar": "caterpillar",
}
"""Experiment that shows a gait."""


def gaits(runs: Runs, path: Path) -> Path:
    """Each gait after one and two periods, or the last one of a shorter run, and the heights of its links then."""
    drawn, axes = drawing.figure(len(GAITS), 2, 8.0, 11.0)
    for row, (title, name) in zip(axes, GAITS.items(), strict=True):
        run = runs[name]
        end = min(2 * PERIOD, run.time[-1])
        for time in (end - PERIOD, end):
            _links(row[0], runs, name, time, (0, 1))
        row[0].plot(*run.position[run.time <= end, MIDDLE, :2].T, color=drawing.PATH)
        drawing.ground(row[0], f"{title}: from above, path of link 6", (-1.5, 0.7), (-0.6, 0.9))
        shown = run.position[at(run, end)]
        along = np.linalg.norm(shown[:, :2] - shown[0, :2], axis=1)
        height = 1e3 * (shown[:, 2] - np.asarray(AIKO.radius))
        row[1].plot(along, height, "o-", color=drawing.PATH, markersize=3)
        row[1].set(title="height of the links", xlabel="from link 1 [m]", ylabel="z - radius [mm]")
        row[1].set(ylim=(-0.1, max(1.0, 1.1 * height.max())))
    return drawing.save(drawn, path)


def figure_7_2(runs: Runs, path: Path) -> Path:
    """The robot from the side while it falls and comes to rest, and link 1 as it lands."""
    drawn, axes = drawing.figure(2, 4, 10.0, 4.2)
    for k, (ax, time) in enumerate(zip(axes.flat, (0.0, 0.15, 0.23, 0.27, 0.32, 0.37, 0.45, 0.9), strict=True)):
        ax.axhline(0.0, color=drawing.OUTLINE, linewidth=1.0)
        _links(ax, runs, "drop", time, (0, 2))
        drawing.ground(ax, f"({'abcdefgh'[k]}) t = {time:g} s", (-1.5, 0.3), (-0.05, 1.1))
        ax.set(ylabel="z [m]")
    return drawing.save(drawn, path)


def figure_7_3(runs: Runs, path: Path) -> Path:
    """Height and vertical velocity of link 1 during the drop, and the path of link 6; dotted: motors on."""
    run = runs["drop"]
    drawn, axes = drawing.figure(2, 2, 7.0, 4.6)
    fall = run.time <= 1.0
    axes[0, 0].plot(run.time[fall], run.position[fall, 0, 2], color=drawing.PATH)
    axes[0, 0].set(title="(a) height of link 1", xlabel="time [s]", ylabel="z [m]")
    middle = 0.5 * (run.time[1:] + run.time[:-1])
    axes[0, 1].plot(middle[middle < 1.0], vertical_velocity(run, 0)[middle < 1.0], color=drawing.PATH)
    axes[0, 1].set(title="(b) velocity of link 1", xlabel="time [s]", ylabel="v_z [m/s]")
    for k in range(2):
        axes[1, k].plot(run.time, run.position[:, MIDDLE, k], color=drawing.PATH)
        axes[1, k].axvline(SWITCHED_ON, color="black", linewidth=0.6, linestyle=":")
        axes[1, k].set(title=f"({'cd'[k]}) link 6", xlabel="time [s]", ylabel=f"{'xy'[k]} [m]")
    return drawing.save(drawn, path)


def figure_7_4(runs: Runs, path: Path) -> Path:
    """Position of link 6 during U-shaped rolling, three pairs of friction coefficients."""
    return _paths_and_components(runs, "rolling", "U-shaped rolling", path)


def figure_7_5(runs: Runs, path: Path) -> Path:
    """Position of link 6 during sidewinding, three pairs of friction coefficients."""
    return _paths_and_components(runs, "sidewinding", "sidewinding", path)


def figure_7_12(runs: Runs, path: Path) -> Path:
    """The robot during sidewinding at t = 0, 5, 10 and 15 s, from above and from the side."""
    run = f"sidewinding {FRICTION_PAIRS[0]}"
    drawn, axes = drawing.figure(2, 4, 9.0, 4.2, heights=(4, 1))
    x = (-1.4, 0.2)
    for k, time in enumerate((0.0, 5.0, 10.0, 15.0)):
        _links(axes[0, k], runs, run, time, (0, 1))
        drawing.ground(axes[0, k], f"t = {time:g} s, from above", x, (-0.3, 1.7))
        _links(axes[1, k], runs, run, time, (0, 2))
        drawing.ground(axes[1, k], "from the side", x, (-0.02, 0.25))
        axes[1, k].set(ylabel="z [m]")
    return drawing.save(drawn, path)


def figure_7_13(runs: Runs, path: Path) -> Path:
    """Position of link 6 during sidewinding: stiff joints as in the thesis's model, and joints as weak as Aiko's."""
    drawn, axes = drawing.figure(1, 3, 9.0, 3.2)
    curves = {"k_P = 800": f"sidewinding {FRICTION_PAIRS[0]}", f"k_P = {WEAK_GAIN:g}": "sidewinding, weak joints"}
    for (label, name), colour in zip(curves.items(), COLOURS, strict=False):
        run = runs[name]
        way = run.position[:, MIDDLE] - run.position[0, MIDDLE]
        for k in range(2):
            axes[0, k].plot(run.time, way[:, k], color=colour, label=label)
        axes[0, 2].plot(way[:, 0], way[:, 1], color=colour)
    for k in range(2):
        axes[0, k].set(title=f"({'ab'[k]})", xlabel="time [s]", ylabel=f"{'xy'[k]} [m]")
    axes[0, 0].legend(title="[N m/rad]")
    drawing.ground(axes[0, 2], "(c) sidewinding, link 6", (-0.4, 0.8))
    return drawing.save(drawn, path)


def figure_7_15(runs: Runs, path: Path) -> Path:
    """The robot on the course of Table 7.5 at t = 0, 3, 6 and 9 s."""
    drawn, axes = drawing.figure(4, 1, 7.0, 7.6)
    for k, time in enumerate((0.0, 3.0, 6.0, 9.0)):
        drawing.pegs(axes[k, 0], runs.experiment("table 7.5, 3D").scene)
        _links(axes[k, 0], runs, "table 7.5, 3D", time, (0, 1))
        drawing.ground(axes[k, 0], f"t = {time:g} s", (-0.15, 2.65), (-0.15, 0.38))
    return drawing.save(drawn, path)


def stairs(runs: Runs, path: Path) -> Path:
    """Sidewinding on steps of 2 cm with the thesis's lift and with twice that, from the side at four times."""
    drawn, axes = drawing.figure(2, 4, 10.0, 2.8)
    for row, case in zip(axes, (CASES[1], CASES[2]), strict=True):
        run = experiment_name(*case)
        for k, (ax, time) in enumerate(zip(row, (0.0, 10.0, 25.0, 60.0), strict=True)):
            ax.axhline(0.0, color=drawing.OUTLINE, linewidth=1.0)
            for step in flight(0.01 * case[1]):
                near = step.y - 0.5 * step.size[1]
                ax.fill_between((near, near + step.size[1]), step.height, color=drawing.PEG, linewidth=0.0)
            _links(ax, runs, run, time, (1, 2))
            centre = float(runs[run].position[at(runs[run], time), :, 1].mean())
            title = f"A_v = {case[0]} deg, t = {time:g} s" if k == 0 else f"t = {time:g} s"
            ax.set(title=title, xlabel="y [m]", xlim=(centre - 0.7, centre + 0.7), ylim=(-0.02, 0.3))
            ax.set(ylabel="z [m]" if k == 0 else "", aspect="equal")
    return drawing.save(drawn, path)


FIGURES: dict[str, tuple[str, Callable[[Runs, Path], Path]]] = {
    "gaits.png": ("2.4.2", gaits),
    "figure-7.2.png": ("7.3.1", figure_7_2),
    "figure-7.3.png": ("7.3.1", figure_7_3),
    "figure-7.4.png": ("7.3.2", figure_7_4),
    "figure-7.5.png": ("7.3.3", figure_7_5),
    "figure-7.12.png": ("7.5.1", figure_7_12),
    "figure-7.13.png": ("7.5.1", figure_7_13),
    "figure-7.15.png": ("7.5.3", figure_7_15),
    "figure-8-stairs.png": ("8", stairs),
}
"""File name -> section and function."""


def _paths_and_components(runs: Runs, motion: str, title: str, path: Path) -> Path:
    drawn, axes = drawing.figure(1, 3, 9.0, 3.2)
    for friction, colour in zip(FRICTION_PAIRS, COLOURS, strict=True):
        run = runs[f"{motion} {friction}"]
        way = run.position[:, MIDDLE] - run.position[0, MIDDLE]
        axes[0, 0].plot(way[:, 0], way[:, 1], color=colour)
        for k in range(2):
            axes[0, 1 + k].plot(run.time, way[:, k], color=colour, label=f"{friction}")
    drawing.ground(axes[0, 0], f"(a) {title}, link 6")
    for k in range(2):
        axes[0, 1 + k].set(title=f"({'bc'[k]})", xlabel="time [s]", ylabel=f"{'xy'[k]} [m]")
    axes[0, 2].legend(title="(mu_x, mu_y)")
    return drawing.save(drawn, path)


def _links(drawn: Axes, runs: Runs, name: str, time: float, view: tuple[int, int]) -> None:
    """The links' outlines at one time, seen along the axis that is not in ``view``."""
    run, robot = runs[name], runs.experiment(name).robot
    sample = at(run, time)
    axis = link_axes(run)[1][sample][:, view]
    half, radius = (np.broadcast_to(value, robot.links) for value in (robot.contact_half_length, robot.radius))
    for i, centre in enumerate(run.position[sample][:, view]):
        shown = float(half[i]) * float(np.linalg.norm(axis[i]))
        outline = drawing.stadium(centre, float(np.arctan2(axis[i, 1], axis[i, 0])), shown, float(radius[i]))
        drawing.outline(drawn, outline)
