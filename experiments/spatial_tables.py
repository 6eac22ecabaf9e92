"""The tables of docs/spatial-method.md: errors and rates by step, and unconverged stages as friction grows.

    python -m experiments.spatial_tables
    python -m experiments.spatial_tables --tables stages

Errors are those of link 6 after 5 s against steps of 0.25 ms, worst of all samples in brackets; rates are simulated
seconds per second of this thread's CPU time. Two tables of Markdown; some minutes.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np

import snake_env
from snake_env import PD, Gait, Integrator, Scene, Start, Trajectory
from snake_env.markdown import table
from training.cli import answer

DURATION = 5.0
MIDDLE = 5
"""Link 6."""

SCENES: dict[str, dict[str, Any]] = {
    "course of Table 7.5": {"scene": Scene.preset("table-7.5", (0.2, 0.2)), "gait": Gait()},
    "sidewinding from rest": {
        "scene": Scene.preset("free", (0.2, 0.2)),
        "gait": Gait.sidewinding(soft_start=True),
        "start": Start(posture="straight"),
    },
}
"""Keywords of simulations."""

STEPS = (0.1, 0.05, 0.025, 0.01, 0.005)
FINE = 2.5e-4

FRICTION = ((0.0, 0.0), (0.2, 0.2), (0.01, 1.0), (1.0, 1.0), (2.0, 2.0))
COURSES = ("free", "table-7.3")
GAITS = (
    Gait.lateral_undulation(),
    Gait.sidewinding(),
    Gait.lateral_rolling(),
    Gait.sidewinding(amplitude=np.radians(50), vertical_amplitude=np.radians(40)),
)
LIMITS = ((0.01, None), (0.025, 5.0))
"""Steps [s] and torque limits [N m] that go together."""


def run(**keywords: Any) -> tuple[Trajectory, float]:
    """A trajectory in 3D, and its simulated seconds per second."""
    start = time.thread_time()
    trajectory = snake_env.simulate("spatial", duration=DURATION, **keywords)
    return trajectory, DURATION / (time.thread_time() - start)


def errors() -> Iterator[tuple[str, ...]]:
    """Rows of the table of steps."""
    fine = {name: run(integrator=Integrator(step=FINE), **scene)[0] for name, scene in SCENES.items()}
    for step in STEPS:
        cells: list[str] = []
        for name, scene in SCENES.items():
            trajectory, rate = run(integrator=Integrator(step=step), **scene)
            distance = np.linalg.norm((trajectory.position - fine[name].position)[:, MIDDLE], axis=1)
            cells.append(f"{1e3 * distance[-1]:.2g} mm ({1e3 * distance.max():.2g})")
            cells.append(f"{trajectory.iterations.sum():,.0f}, {rate:.0f}")
        yield f"{1e3 * step:g} ms", *cells


def stages() -> Iterator[tuple[str, ...]]:
    """Rows of the table of friction."""
    for friction in FRICTION:
        runs = {
            (course, gait, step): run(
                scene=Scene.preset(course, friction),
                gait=gait,
                controller=PD(torque_limit=limit),
                integrator=Integrator(step=step),
            )[0]
            for course, gait, (step, limit) in product(COURSES, GAITS, LIMITS)
        }
        fallbacks, missed = ([getattr(one, k).sum() for one in runs.values()] for k in ("fallbacks", "unconverged"))
        worst = max(one.residual.max() for one in runs.values())
        deepest = max(one.max_penetration for (course, *_), one in runs.items() if course == "free")
        counts = f"{sum(fallbacks):,.0f}", f"{sum(missed):,.0f}; {max(missed):,.0f}"
        yield str(friction), *counts, f"{worst:.0e} m/s", f"{1e3 * deepest:.1g} mm"


HEADS = {
    "steps": ("step", *(head for name in SCENES for head in (name, "solves, rate"))),
    "stages": (
        "friction (mu_x, mu_y)",
        "fallbacks, all runs",
        "unconverged, all runs; most in one",
        "worst residual",
        "deepest without pegs",
    ),
}
ROWS = {"steps": errors, "stages": stages}


@dataclass
class Options:
    """Selection.

    Args:
        tables: Tables to print.
    """

    tables: tuple[Literal["steps", "stages"], ...] = ("steps", "stages")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, print_tables, __doc__, arguments)


def print_tables(args: Options) -> int:
    """Prints the tables."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # unconverged stages and penetrations are what is counted
        for name in args.tables:
            print(table(HEADS[name], ROWS[name]()), end="\n\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
