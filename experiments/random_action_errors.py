"""Error and bias of the time stepping where learning takes place: under random actions.

    python -m experiments.random_action_errors
    python -m experiments.random_action_errors --tasks spatial-open --precisions default --seed 5

Robots of one batch start alike and draw the same action of their mode in every control period of 50 ms; a batch that
takes far finer steps is the reference. The error is that of the worst link of a robot, after the first period and after
one second, since contacts amplify errors; the bias is that of the positive work of the actuators of all robots, with
its standard error over robots. Prints a table in Markdown, and the
machine.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.results import machine, place
from snake_env import SnakeVectorEnv
from snake_env.markdown import table
from training.cli import answer
from training.config import Count, Seed

Array = NDArray[np.float64]

TASKS: dict[str, dict[str, Any]] = {
    "field": {"task": "field", "difficulty": 0.5},
    "corridor": {"task": "corridor"},
    "maze": {"task": "maze"},
    "course": {"task": "course"},
    "perturbed": {"task": "perturbed"},
    "open": {"task": "free"},
    "spatial-open": {"task": "free", "model": "spatial"},
    "spatial-field": {"task": "field", "difficulty": 0.5, "model": "spatial"},
    "spatial-course": {"task": "course", "model": "spatial"},
}
FINE = {"step": 6.25e-4, "step_tolerance": 1e-6, "impact_step": 1e-4}
REFERENCE = {"planar": {"tolerance": 1e-7, **FINE}, "spatial": {"tolerance": 1e-6, **FINE}}
"""Of the reference: options of :class:`snake_env.Integrator`, by model."""

HEAD = (
    "scene",
    "actions",
    "precision",
    "linear solves per period",
    "time per period [us]",
    "error after 50 ms [mm]",
    "after 1 s, median [mm]",
    "95 % [mm]",
    "bias of work [%]",
)


@dataclass
class Options:
    """What is measured.

    Args:
        tasks: Scenes: "field", "corridor", "maze", "course", "perturbed", "open", or in 3D "spatial-open",
            "spatial-field", "spatial-course".
        modes: Action modes.
        precisions: "fast", "default", "fine".
        num_envs: Robots.
        periods: Control periods, 50 ms each.
        seed: Of scenes and actions.
    """

    tasks: tuple[str, ...] = tuple(TASKS)
    modes: tuple[str, ...] = ("gait", "joints")
    precisions: tuple[str, ...] = ("fast", "default", "fine")
    num_envs: Count = 96
    periods: Count = 20
    seed: Seed = 11


@dataclass
class Run:
    """The run of a batch.

    Args:
        position: CGs of the links at the end of each control period (periods, robots, links, 2 or 3) [m].
        work: Positive work of the actuators (robots,) [J].
        ended: Robots whose episode ended (robots,).
        solves: Linear solves per robot and control period.
        seconds: CPU time per robot and control period [s].
    """

    position: Array
    work: Array
    ended: NDArray[np.bool_]
    solves: float
    seconds: float


def simulate(task: str, mode: str, args: Options, **accuracy: Any) -> Run:
    """Runs a batch under the seeded random actions of a mode."""
    envs = SnakeVectorEnv(args.num_envs, action_mode=mode, num_threads=1, **TASKS[task], **accuracy)
    envs.reset(seed=args.seed)
    random = np.random.default_rng(args.seed)
    position, work, ended = [], np.zeros(args.num_envs), np.zeros(args.num_envs, dtype=bool)
    solves, seconds = 0.0, 0.0
    for _ in range(args.periods):
        actions = random.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        begin = time.process_time()
        *_, terminated, truncated, info = envs.step(actions)
        seconds += time.process_time() - begin
        ended |= terminated | truncated
        work += info["positive_work"]
        solves += float(np.mean(info["iterations"]))
        position.append(np.array(envs.state().link_position))
    envs.close()
    return Run(np.array(position), work, ended, solves / args.periods, seconds / (args.periods * args.num_envs))


def finely(task: str, mode: str, args: Options) -> Run:
    """The reference."""
    return simulate(task, mode, args, integrator=REFERENCE[TASKS[task].get("model", "planar")])


def row(task: str, mode: str, precision: str, run: Run, reference: Run) -> tuple[str, ...]:
    """A row of the table, of the robots whose episode goes on in both runs."""
    both = ~(run.ended | reference.ended)
    error = 1e3 * np.linalg.norm(run.position - reference.position, axis=-1).max(axis=-1)[:, both]
    excess, mean = (run.work - reference.work)[both], reference.work[both].mean()
    bias, spread = 100 * excess.mean() / mean, 100 * excess.std() / np.sqrt(both.sum()) / mean
    figures = (np.median(error[0]), np.median(error[-1]), np.quantile(error[-1], 0.95))
    cost = (f"{run.solves:.1f}", f"{1e6 * run.seconds:.0f}")
    return (task, mode, precision, *cost, *(f"{figure:.2f}" for figure in figures), f"{bias:+.1f} ({spread:.1f})")


def measure(args: Options) -> int:
    """Prints the table."""
    rows = []
    for task, mode in product(args.tasks, args.modes):
        reference = finely(task, mode, args)
        for precision in args.precisions:
            rows.append(row(task, mode, precision, simulate(task, mode, args, precision=precision), reference))
    print(table(HEAD, rows), place(machine()), sep="\n\n")
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, measure, __doc__, arguments)


if __name__ == "__main__":
    sys.exit(main())
