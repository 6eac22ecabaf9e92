"""The picture of section 5.3: Gray's three links, and push-points off the centre line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from snake_env import drawing
from snake_env.config.section import DEGREE
from snake_env.reproduce.experiment import PERIOD, Runs
from snake_env.reproduce.measures import torque_beyond
from snake_env.reproduce.mechanism import ALPHAS, BETA, OFFSETS, ROBOT, peg_forces, push

SHOWN = (50, 30, 10)
"""Angles alpha of the drawings [deg]."""
SCALE = 0.002
"""Length of a force arrow [m/N]."""


def figure_5_2(runs: Runs, path: Path) -> Path:
    """Three links with the pegs' forces; their sum over alpha; lateral force and torque over the place of the pegs."""
    drawn, axes = drawing.figure(2, 3, 10.0, 5.6)
    for ax, alpha, letter in zip(axes[0], SHOWN, "abc", strict=True):
        _three_links(ax, runs, alpha, letter)
    _resultant(axes[1, 0], runs)
    names = [f"pegs off {offset:g}" for offset in OFFSETS]
    pushes = [push(runs[name], PERIOD, 2 * PERIOD) for name in names]
    torques = [torque_beyond(runs[name], runs["beta -50, no pegs"], PERIOD, 2 * PERIOD) for name in names]
    places = [100 * p.place for p in pushes]
    for values, label, colour in (
        ([p.across for p in pushes], "across", drawing.FORCE),
        ([p.ahead for p in pushes], "ahead", drawing.PATH),
    ):
        axes[1, 1].plot(places, values, "o-", color=colour, label=label)
    axes[1, 1].set(title="(e) force of the pegs, gait (7.3)", ylabel="[N]", ylim=(0.0, None))
    axes[1, 1].legend()
    axes[1, 2].plot(places, torques, "o-", color=drawing.PATH)
    axes[1, 2].set(title="(f) joint torques by the pegs, RMS", ylabel="[N m]", ylim=(0.0, None))
    for ax in axes[1, 1:]:
        ax.set(xlabel="push-points from the centre line [cm]", xlim=(0.0, None))
    return drawing.save(drawn, path)


def _three_links(ax: Axes, runs: Runs, alpha: int, letter: str) -> None:
    name = f"three links {alpha}"
    run = runs[name]
    drawing.pegs(ax, runs.experiment(name).scene)
    drawing.body(ax, ROBOT, run.position[0], run.angle[0], numbered=(1, 2, 3))
    drawing.forces(ax, run.position[0], run.contact_force[1], SCALE)
    relation = "=" if alpha == BETA else ">" if alpha > BETA else "<"
    drawing.ground(ax, f"({letter}) alpha = {alpha} {relation} beta = {BETA} deg", (-0.26, 0.26), (-0.12, 0.22))


def _resultant(ax: Axes, runs: Runs) -> None:
    angles = np.linspace(0.0, 60.0, 50)
    statics = [peg_forces(angle * DEGREE, BETA * DEGREE).sum(axis=0)[0] for angle in angles]
    ax.plot(angles, statics, color=drawing.PEG, label="statics")
    found = [runs[f"three links {alpha}"].contact_force[1].sum(axis=0)[0] for alpha in ALPHAS]
    ax.plot(ALPHAS, found, "o", color=drawing.PATH, label="simulated")
    ax.axvline(BETA, color="black", linewidth=0.6, linestyle=":")
    ax.set(title="(d) sum of the forces ahead", xlabel="alpha [deg]", ylabel="[N]")
    ax.legend()


FIGURES: dict[str, tuple[str, Callable[[Runs, Path], Path]]] = {"figure-5.2.png": ("5.3", figure_5_2)}
"""File name -> section and function."""
