"""Errors of the default step where learning takes place: under random actions.

    python -m experiments.random_action_errors
    python -m experiments.random_action_errors --steps 0.025 0.0125 --event-substeps 4 8

Robots of one batch start alike and draw the same action of their mode in every control period; a batch that takes fine
steps is the reference. Contacts amplify errors, so that they grow over the run whatever the step: the error is that of
the worst link of a robot, after the first control period and at its largest over the run, as median and 90th percentile
over the robots. Prints a table in Markdown.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import SnakeVectorEnv
from snake_env.markdown import table
from training.cli import answer
from training.config import Count, Seed

Array = NDArray[np.float64]

TASKS: dict[str, dict[str, Any]] = {
    "course": {"task": "course"},
    "field": {"task": "field", "difficulty": 0.5},
    "spatial-course": {"task": "course", "model": "spatial"},
    "spatial-field": {"task": "field", "difficulty": 0.5, "model": "spatial"},
}
MODES = ("gait", "joints")
HEAD = (
    "task",
    "actions",
    "step [ms], parts",
    "solves per period",
    "one period: median [mm]",
    "90 % [mm]",
    "run: median [mm]",
    "90 % [mm]",
)


@dataclass
class Options:
    """What is measured.

    Args:
        tasks: "course", "field", or these in 3D with "spatial-" before.
        modes: Action modes.
        steps: Longest steps [s].
        event_substeps: Parts into which an abrupt step is divided.
        reference: Step of the reference [s].
        num_envs: Robots.
        periods: Control periods, 50 ms each.
        seed: Of scenes and actions.
    """

    tasks: tuple[str, ...] = ("course", "field")
    modes: tuple[str, ...] = MODES
    steps: tuple[float, ...] = (0.025,)
    event_substeps: tuple[int, ...] = (4,)
    reference: float = 0.00025
    num_envs: Count = 128
    periods: Count = 20
    seed: Seed = 0


@dataclass
class Run:
    """The run of a batch.

    Args:
        position: CGs of the links at the end of each control period (periods, robots, links, 2) [m].
        ended: Robots whose episode ended (robots,).
        solves: Linear solves per robot and control period.
    """

    position: Array
    ended: NDArray[np.bool_]
    solves: float


def simulate(task: str, mode: str, integrator: dict[str, Any], args: Options) -> Run:
    """Runs a batch under the seeded random actions of a mode."""
    envs = SnakeVectorEnv(args.num_envs, action_mode=mode, integrator=integrator, **TASKS[task])
    envs.reset(seed=args.seed)
    random = np.random.default_rng(args.seed)
    position, ended, solves = [], np.zeros(args.num_envs, dtype=bool), 0.0
    for _ in range(args.periods):
        actions = random.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        *_, terminated, truncated, info = envs.step(actions)
        ended |= terminated | truncated
        solves += float(np.mean(info["iterations"])) / args.periods
        position.append(np.array(envs.state().link_position))
    envs.close()
    return Run(np.array(position), ended, solves)


def errors(run: Run, reference: Run) -> Array:
    """Error of the worst link of each robot whose episode goes on in both (periods, robots) [m]."""
    distance = np.linalg.norm(run.position - reference.position, axis=-1).max(axis=-1)
    return np.asarray(distance[:, ~(run.ended | reference.ended)])


def row(task: str, mode: str, step: float, parts: int, run: Run, reference: Run) -> tuple[str, ...]:
    """A row of the table."""
    error = 1e3 * errors(run, reference)
    figures = [np.quantile(each, share) for each in (error[0], error.max(axis=0)) for share in (0.5, 0.9)]
    return (task, mode, f"{1e3 * step:g}, {parts}", f"{run.solves:.1f}", *(f"{figure:.2f}" for figure in figures))


def measure(args: Options) -> int:
    """Prints the table."""
    rows = []
    for task, mode in product(args.tasks, args.modes):
        reference = simulate(task, mode, {"step": args.reference}, args)
        for step, parts in product(args.steps, args.event_substeps):
            run = simulate(task, mode, {"step": step, "event_substeps": parts}, args)
            rows.append(row(task, mode, step, parts, run, reference))
    print(table(HEAD, rows))
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, measure, __doc__, arguments)


if __name__ == "__main__":
    sys.exit(main())
