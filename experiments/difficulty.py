"""Does difficulty order the tasks? Success of the thesis's gait, which uses no observations, against `difficulty`.

    python -m experiments.difficulty
    python -m experiments.difficulty --tasks field maze --fields 100

Held-out fields, the same ones at every difficulty. Prints a table in Markdown and draws it.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snake_env import ConfigError, drawing
from snake_env.evaluation import seeds
from snake_env.evaluation.rollout import run_episodes
from snake_env.evaluation.statistics import Estimate, mean_interval
from snake_env.markdown import table
from snake_env.policies.gaits import GaitParameters, GaitPolicy
from snake_env.registration import TASKS
from training.cli import answer
from training.config import Count

OPTIONS: dict[str, dict[str, Any]] = {
    "field": {"task": "field"},
    "solvable": {"task": "field", "push_points": 3},
    "perturbed": {"task": "perturbed"},
    "maze": {"task": "maze"},
    "corridor": {"task": "corridor"},
}
"""The tasks that have a difficulty; "solvable" are fields with three push-points in every body length."""
DIFFICULTIES = (0.0, 0.25, 0.5, 0.75, 1.0)

Curve = list[Estimate]


@dataclass
class Options:
    """What is measured.

    Args:
        tasks: Names.
        difficulties: In [0, 1].
        fields: Held-out episodes at each difficulty.
        num_threads: Threads of the simulator.
        picture: PNG file.
    """

    tasks: tuple[str, ...] = tuple(OPTIONS)
    difficulties: tuple[float, ...] = DIFFICULTIES
    fields: Count = 500
    num_threads: int | None = None
    picture: Path = Path("runs/difficulty.png")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Prints and draws the curves of the tasks."""
    for name in args.tasks:
        if name not in OPTIONS:
            raise ConfigError("task", name, f"one of {', '.join(OPTIONS)}")
    curves = {name: measure(OPTIONS[name], args.difficulties, args.fields, args.num_threads) for name in args.tasks}
    print(rates(curves, args.difficulties))
    args.picture.parent.mkdir(parents=True, exist_ok=True)
    print(draw(curves, args.difficulties, args.picture))
    return 0


def measure(options: dict[str, Any], difficulties: tuple[float, ...], fields: int, num_threads: int | None) -> Curve:
    """Success rate of the thesis's gait, difficulty by difficulty."""
    env_id = next(env_id for env_id, made_by in TASKS.items() if made_by == {"task": options["task"]})
    policy = GaitPolicy(GaitParameters())
    curve = []
    for difficulty in difficulties:
        given = options | {"difficulty": difficulty}
        episodes = run_episodes(policy, env_id, seeds.held_out(fields), num_threads, **given)
        curve.append(mean_interval(episodes["is_success"].astype(float)))
    return curve


def rates(curves: dict[str, Curve], difficulties: tuple[float, ...]) -> str:
    """Success rates with their 95 % confidence intervals as Markdown."""
    rows = {
        name: [f"{one.value:.2f} [{one.low:.2f}, {one.high:.2f}]" for one in curve] for name, curve in curves.items()
    }
    head = ["task", *(f"{difficulty:g}" for difficulty in difficulties)]
    return table(head, ([name, *cells] for name, cells in rows.items()))


def draw(curves: dict[str, Curve], difficulties: tuple[float, ...], path: Path) -> Path:
    """Success over difficulty, one line per task."""
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
