"""The picture of section 6.3.3: Theorem 6.1 for a gait that satisfies its condition."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from snake_env import drawing
from snake_env.reproduce import lyapunov
from snake_env.reproduce.experiment import Runs

NORMS = tuple(float(norm) for norm in np.geomspace(1e-3, 1e4, 22))
"""Of w, where V' is sampled."""
SAMPLES = 60


def figure_theorem(runs: Runs, path: Path) -> Path:
    """V along a solution; V' over |w| with the proof's bound; |w| in the slow gait."""
    drawn, axes = drawing.figure(1, 3, 10.0, 3.4)
    known = lyapunov.constants()
    times, _, energy = lyapunov.decay()
    axes[0, 0].plot(times, energy, color=drawing.PATH)
    axes[0, 0].set(title="(a) V from w = (2, 2, 4)", xlabel="time [s]", ylabel="V [J]", yscale="log")
    rates = lyapunov.random_rates(NORMS, SAMPLES)
    norms = np.array(NORMS)
    axes[0, 1].fill_between(norms, rates.min(axis=1), rates.max(axis=1), color=drawing.BODY, label="random w")
    axes[0, 1].plot(norms, rates.max(axis=1), color=drawing.OUTLINE)
    axes[0, 1].plot(norms, known.k5 / norms - known.k6, color=drawing.FORCE, label="(6.114)")
    axes[0, 1].axvline(known.mu, color="black", linewidth=0.8, linestyle=":", label="mu")
    axes[0, 1].set(title="(b) V' / |w|^2 [1/s]", xlabel="|w|", xscale="log", ylim=(-10.0, 10.0))
    axes[0, 1].legend(loc="lower left", bbox_to_anchor=(0.19, 0.4))
    run = runs["IO, slow"]
    axes[0, 2].plot(run.time, lyapunov.speed(run), color=drawing.PATH, label="slow gait")
    axes[0, 2].axhline(known.ultimate, color=drawing.FORCE, label="ultimate bound (A.6)")
    axes[0, 2].set(title="(c) |w| over a period", xlabel="time [s]", yscale="log", ylim=(1e-4, 1e5))
    axes[0, 2].legend(loc="center right")
    return drawing.save(drawn, path)


FIGURES: dict[str, tuple[str, Callable[[Runs, Path], Path]]] = {"figure-6.3.3-theorem.png": ("6.3.3", figure_theorem)}
"""File name -> section and function."""
