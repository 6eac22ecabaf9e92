"""Tune the parameters of the scripted controllers on validation fields.

    python -m training tune
    python -m training tune --tasks field-hard --controllers "best gait" "heading control"

For each task and controller Optuna searches within the controller's ranges for the highest success rate plus share of
the way made, under the task's limits of torque and time. Results go to ``snake_env/policies/scripted/tuned.json``,
where those of other tasks and controllers stay. What stands there takes part in the search and its final, so that it
gives way to better values only.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._files import write_json
from snake_env.evaluation import rollout, seeds, tasks
from snake_env.evaluation.tasks import GOAL, BenchmarkTask
from snake_env.policies.scripted import catalogue
from snake_env.policies.scripted.controller import Controller
from training.search.optimise import Plan, Values, maximise

PLAN = Plan(batches=6, candidates=48, fields=8, finalists=6, final_fields=400)


@dataclass
class Options:
    """What is tuned.

    Args:
        tasks: Of snake_env/evaluation/tasks.json; all if absent.
        controllers: Names.
        num_threads: Threads of the simulator.
        quick: About a tenth of the search.
        out: JSON file.
    """

    tasks: tuple[str, ...] | None = None
    controllers: tuple[str, ...] = tuple(catalogue.CONTROLLERS)
    num_threads: int | None = None
    quick: bool = False
    out: Path = catalogue.TUNED


def tune_all(args: Options) -> int:
    """Tunes the controllers for the tasks, one after another; each result is kept at once."""
    kinds = {title: catalogue.kind(title) for title in args.controllers}
    plan = PLAN.quick() if args.quick else PLAN
    for task in tasks.chosen(args.tasks):
        for title, kind in kinds.items():
            start = time.monotonic()
            found = tune(kind, task, plan, args.num_threads, standing(args.out, kind, task))
            keep(args.out, task.name, title, found)
            print(f"[{time.monotonic() - start:4.0f} s] {task.name}, {title}: {found}", flush=True)
    return 0


def standing(path: Path, kind: type[Controller], task: BenchmarkTask) -> list[Values]:
    """The parameters that a controller has for a task so far, within its ranges; none if it was never tuned."""
    found = catalogue.chosen(kind.title, task.name, path)
    return [{name: float(np.clip(found["values"][name], *span)) for name, span in kind.ranges.items()}] if found else []


def tune(
    kind: type[Controller],
    task: BenchmarkTask,
    plan: Plan = PLAN,
    num_threads: int | None = None,
    first: Sequence[Values] = (),
) -> dict[str, Any]:
    """The best parameters of a controller for a task, ``first`` among them, and its means on the final fields."""

    def score(tried: list[Values], fields: list[int]) -> NDArray[np.float64]:
        means = play(kind, tried, task, fields, num_threads)
        return means["success"] + means["way"]

    found = maximise(kind.ranges, score, plan, first)
    values = {name: round(value, 6) for name, value in found.best.items()}
    means = play(kind, [values], task, seeds.selection(plan.final_fields, plan.fields), num_threads)
    rounded = {name: round(float(mean[0]), 3) for name, mean in means.items()}
    return {"values": values, **rounded, "fields": plan.final_fields}


def play(
    kind: type[Controller], tried: list[Values], task: BenchmarkTask, fields: list[int], num_threads: int | None
) -> dict[str, NDArray[np.float64]]:
    """Success rate, share of the way and speed [m/s] of each candidate (c,): means over the same fields."""
    values = {name: np.repeat([one[name] for one in tried], len(fields)) for name in kind.ranges}
    episodes = rollout.run_episodes(kind(values), task.env_id, fields * len(tried), num_threads, **task.options)
    goal = float(task.options.get("goal_distance", GOAL))
    signals = {
        "success": episodes["is_success"].astype(np.float64),
        "way": np.clip(episodes["distance"] / goal, 0.0, 1.0),
        "speed": episodes["speed"],
    }
    return {name: signal.reshape(len(tried), len(fields)).mean(axis=1) for name, signal in signals.items()}


def keep(path: Path, task: str, title: str, found: dict[str, Any]) -> None:
    """Adds a result to the file."""
    content = catalogue.read(path)
    content.setdefault(task, {})[title] = found
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, content)
