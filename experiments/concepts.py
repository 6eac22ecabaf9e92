"""The drawing of docs/concepts.md: how a robot pushes itself off pegs, joint and wave, and set-valued friction.

python -m experiments.pictures --only concepts.png
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from snake_env.config import Robot
from snake_env.drawing import FORCE, FORCE_SCALE, PATH, body, figure, forces, ground, outline, pegs, save, stadium
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.measures import at, mean_force

RUN = "table 7.3"
INSTANT = 5.2
"""When three links are pushed [s]."""
MU = 0.2


def draw(runs: Runs, path: Path) -> Path:
    """Robot among pegs above; joint angle, friction force and admissible forces below."""
    drawn, axes = figure(2, 3, 8.0, 5.6, heights=(1.0, 1.1))
    grid = axes[0, 0].get_gridspec()
    for one in axes[0]:
        one.remove()
    _pushes(drawn.add_subplot(grid[0, :]), runs)
    _joint(axes[1, 0])
    _friction(axes[1, 1])
    _ellipse(axes[1, 2])
    return save(drawn, path)


def _pushes(axes: Axes, runs: Runs) -> None:
    """The robot on the course, the forces of the pegs on its links and their sum."""
    run = runs[RUN]
    k = at(run, INSTANT)
    position = run.position[k]
    title = f"Push-points: pegs push links (red); the sum of their forces (black) points forward ({FORCE_SCALE:g} m/N)"
    ground(axes, title, x=(0.6, 2.1), y=(-0.12, 0.32))
    pegs(axes, runs.experiment(RUN).scene)
    body(axes, Robot(), position, run.angle[k], numbered=tuple(range(1, 12)))
    forces(axes, position, mean_force(run, INSTANT - 0.05, INSTANT + 0.05))
    axes.annotate("link 1 leads", (2.02, 0.24), ha="center")


def _joint(axes: Axes) -> None:
    """Two links and the angle between them."""
    angle, length = np.radians(35.0), 0.122
    middle = np.array([[0.5 * length, 0.0], [-0.5 * length * np.cos(angle), -0.5 * length * np.sin(angle)]])
    ground(axes, "A joint angle phi", (-0.2, 0.2), (-0.16, 0.12))
    body(axes, Robot(links=2), middle, np.array([0.0, angle]), numbered=(1, 2))
    arc = np.linspace(np.pi, np.pi + angle, 30)
    axes.plot(0.09 * np.cos(arc), 0.09 * np.sin(arc), color=FORCE)
    axes.plot([0.0, -0.13], [0.0, 0.0], color="0.4", linestyle=":")
    axes.annotate("phi", (-0.175, -0.035), color=FORCE)
    axes.plot(0.0, 0.0, "o", color="black", markersize=4)


def _friction(axes: Axes) -> None:
    """Force against slip of a link."""
    slip = np.linspace(-1.0, 1.0, 201)
    axes.plot([-1, 0, 0, 1], [MU, MU, -MU, -MU], color=PATH, linewidth=2.0, label="set-valued: any value at rest")
    axes.plot(slip, -MU * np.tanh(slip / 0.2), color=FORCE, linestyle="--", label="regularised: creeps")
    axes.set(title="Coulomb friction", xlabel="slip", ylabel="force over weight", ylim=(-0.3, 0.42), xticks=[0])
    axes.legend(fontsize=7, loc="upper right")


def _ellipse(axes: Axes) -> None:
    """Admissible friction forces where friction differs along and across a link."""
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    axes.fill(0.2 * np.cos(turn), 0.5 * np.sin(turn), facecolor="#dbe7f3", edgecolor=PATH)
    outline(axes, stadium(np.zeros(2), 0.0, 0.11, 0.05))
    axes.set(title="Set of friction forces", xlabel="along the link", ylabel="across", xlim=(-0.7, 0.7))
    axes.set_aspect("equal", adjustable="box")
