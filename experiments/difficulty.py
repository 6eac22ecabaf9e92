"""Does difficulty order the tasks? Success of the thesis's gait, which never looks, against `difficulty`.

    python -m experiments.difficulty
    python -m experiments.difficulty --tasks field,maze --fields 100

Held-out fields, the same ones at every difficulty. Prints a table in Markdown and draws it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from snake_env import ConfigError, _markdown
from snake_env.registration import TASKS
from snake_env.reproduce import drawing
from training import seeds
from training.cli import answer, help_format, names, numbers
from training.evaluation.evaluate import gait_policy
from training.evaluation.statistics import Estimate, mean_interval
from training.policies.gaits import GaitParameters
from training.rollout import run_episodes

OPTIONS: dict[str, dict[str, Any]] = {
    "field": {"task": "field"},
    "solvable": {"task": "field", "push_points": 3},
    "perturbed": {"task": "perturbed"},
    "maze": {"task": "maze"},
    "corridor": {"task": "corridor"},
}
"""The tasks that have a difficulty; "solvable" are fields with three push-points in every body length of the way."""
DIFFICULTIES = (0.0, 0.25, 0.5, 0.75, 1.0)

Curve = list[Estimate]


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    cli = argparse.ArgumentParser("experiments.difficulty", description=__doc__, formatter_class=help_format)
    cli.add_argument("--tasks", type=names, default=list(OPTIONS), help="comma separated")
    cli.add_argument("--difficulties", type=numbers, default=list(DIFFICULTIES), help="comma separated")
    cli.add_argument("--fields", type=int, default=500, help="held-out episodes at each difficulty")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--picture", type=Path, default=Path("runs/difficulty.png"), help="PNG file")
    return answer(cli, compare, arguments)


def compare(args: argparse.Namespace) -> int:
    """Prints and draws the curves of the tasks."""
    for name in args.tasks:
        if name not in OPTIONS:
            raise ConfigError("task", name, f"one of {', '.join(OPTIONS)}")
    curves = {name: measure(OPTIONS[name], args.difficulties, args.fields, args.num_threads) for name in args.tasks}
    print(table(curves, args.difficulties))
    args.picture.parent.mkdir(parents=True, exist_ok=True)
    print(draw(curves, args.difficulties, args.picture))
    return 0


def measure(options: dict[str, Any], difficulties: list[float], fields: int, num_threads: int | None) -> Curve:
    """Success rate of the thesis's gait, difficulty by difficulty."""
    env_id = next(env_id for env_id, made_by in TASKS.items() if made_by == {"task": options["task"]})
    policy = gait_policy(GaitParameters(), env_id, **options)
    curve = []
    for difficulty in difficulties:
        given = options | {"difficulty": difficulty}
        episodes = run_episodes(policy, env_id, seeds.held_out(fields), num_threads, **given)
        curve.append(mean_interval(episodes["is_success"].astype(float)))
    return curve


def table(curves: dict[str, Curve], difficulties: list[float]) -> str:
    """Success rates with their 95 % confidence intervals as Markdown."""
    rows = {
        name: [f"{one.value:.2f} ({one.low:.2f} to {one.high:.2f})" for one in curve] for name, curve in curves.items()
    }
    head = ["task", *(f"{difficulty:g}" for difficulty in difficulties)]
    return _markdown.table(head, ([name, *cells] for name, cells in rows.items()))


def draw(curves: dict[str, Curve], difficulties: list[float], path: Path) -> Path:
    """Success over difficulty, one line a task."""
    with drawing.style():
        drawn, axes = drawing.figure(1, 1, 5.0, 3.0)
        for name, curve in curves.items():
            spread = [one.value - one.low for one in curve], [one.high - one.value for one in curve]
            axes[0, 0].errorbar(difficulties, [one.value for one in curve], spread, capsize=2, label=name)
        axes[0, 0].set(xlabel="difficulty", ylabel="success of the thesis's gait", ylim=(0.0, 1.05))
        axes[0, 0].legend(fontsize=7)
        return drawing.save(drawn, path)


if __name__ == "__main__":
    sys.exit(main())
