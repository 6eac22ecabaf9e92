"""Choose the parameters of the scripted controllers, on seeds that are for choosing alone.

    python -m training.search.tune
    python -m training.search.tune --tasks field-hard --controllers "best gait,heading control"

For each task and controller all combinations of the controller's levels are candidates, or a fixed random part of
them where there are more than ``--candidates``. They play in rounds: all on a few fields, the best on more. The best is
that of the highest success rate plus the share of the way made; both count the torque limit and time limit of the
task. Results go to ``training/policies/scripted/tuned.json``; what is there for other tasks and controllers stays.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training import rollout, seeds, tasks
from training.cli import answer, help_format, names
from training.policies.scripted import catalogue
from training.policies.scripted.controller import Controller
from training.runs import replace, write_json
from training.search.gait_search import Round
from training.tasks import BenchmarkTask

CANDIDATES = 300
ROUNDS = (Round(6, 50), Round(24, 10), Round(100, 1))
"""All candidates on 6 fields, the best 50 on 24 others, the best 10 on 100 others."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.search.tune", description=__doc__, formatter_class=help_format)
    cli.add_argument("--tasks", type=names, help="tasks of training/configs/tasks.json, comma separated; all if absent")
    cli.add_argument("--controllers", type=names, default=list(catalogue.CONTROLLERS), help="comma separated")
    cli.add_argument("--candidates", type=int, default=CANDIDATES, help="most combinations tried for a controller")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--quick", action="store_true", help="a sixth of the fields")
    cli.add_argument("--out", type=Path, default=catalogue.TUNED, help="JSON file")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), tune_all, arguments)


def tune_all(args: argparse.Namespace) -> int:
    """Tunes the controllers for the tasks, one after another."""
    kinds = {title: catalogue.kind(title) for title in args.controllers}
    rounds = [Round(max(1, part.fields // 6), part.keep) for part in ROUNDS] if args.quick else ROUNDS
    for task in tasks.chosen(args.tasks):
        for title, kind in kinds.items():
            start = time.monotonic()
            found = tune(kind, task, rounds, args.candidates, args.num_threads)
            note(args.out, task.name, title, found)
            print(f"[{time.monotonic() - start:4.0f} s] {task.name}, {title}: {found}", flush=True)
    return 0


def tune(
    kind: type[Controller],
    task: BenchmarkTask,
    rounds: Sequence[Round] = ROUNDS,
    most: int = CANDIDATES,
    num_threads: int | None = None,
) -> dict[str, Any]:
    """The best parameters of a controller for a task, and how it did in the last round."""
    left, skip = candidates(kind.levels, most), 0
    for part in rounds:
        fields = seeds.selection(part.fields, skip)
        skip += part.fields
        scores = play(kind, left, task, fields, num_threads)
        best = np.argsort(-(scores["success"] + scores["way"]), kind="stable")[: part.keep]
        left = [left[k] for k in best]
    chosen = {name: round(float(value), 6) for name, value in left[0].items()}
    means = {name: round(float(values[best[0]]), 3) for name, values in scores.items()}
    return {"values": chosen, **means, "fields": rounds[-1].fields}


def candidates(levels: Mapping[str, Sequence[float]], most: int) -> list[dict[str, float]]:
    """All combinations of levels, or ``most`` of them: always the same ones."""
    combinations = list(itertools.product(*levels.values()))
    if len(combinations) > most:
        drawn = np.random.default_rng(0).choice(len(combinations), most, replace=False)
        combinations = [combinations[k] for k in np.sort(drawn)]
    return [dict(zip(levels, combination, strict=True)) for combination in combinations]


def play(
    kind: type[Controller],
    settings: list[dict[str, float]],
    task: BenchmarkTask,
    fields: list[int],
    num_threads: int | None,
) -> dict[str, NDArray[np.float64]]:
    """Success rate, share of the way and speed [m/s] of each setting: means over the same fields, all in one batch."""
    values = {name: np.repeat([one[name] for one in settings], len(fields)) for name in kind.levels}
    episodes = rollout.run_episodes(kind(values), task.env_id, fields * len(settings), num_threads, **task.options)
    shape = (len(settings), len(fields))
    goal = float(task.options.get("goal_distance", GOAL))
    scores = {
        "success": episodes["is_success"].astype(np.float64),
        "way": np.clip(episodes["distance"] / goal, 0.0, 1.0),
        "speed": episodes["speed"],
    }
    return {name: values.reshape(shape).mean(axis=1) for name, values in scores.items()}


GOAL = 2.0
"""Distance of the goal by default [m]."""


def note(path: Path, task: str, title: str, found: dict[str, Any]) -> None:
    """Adds a result to the file."""
    content = catalogue.read(path)
    content.setdefault(task, {})[title] = found
    path.parent.mkdir(parents=True, exist_ok=True)
    replace(path, lambda part: write_json(part, content))


if __name__ == "__main__":
    sys.exit(main())
