"""Success against `difficulty`, and the level that a policy reaches in each family of tasks.

    python -m experiments.difficulty
    python -m experiments.difficulty --tasks field maze --policies general heading-control --robot-class aiko

Held-out fields, the same ones at every difficulty. The level is the highest difficulty up to which at least 0.8 of the
episodes succeed, at it and at all easier ones. Prints a table in Markdown and draws it. The default policy is the
thesis's gait, which uses no observations.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from snake_env import ConfigError, drawing
from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.rollout import run_episodes
from snake_env.evaluation.statistics import Estimate, mean_interval
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.markdown import table
from snake_env.policies.loading import GAIT, load_policy
from training.cli import answer
from training.config import Count

FAMILIES = {
    "field": BenchmarkTask("field-medium", "SnakeField-v1"),
    "solvable": BenchmarkTask("field-solvable", "SnakeField-v1", {"push_points": 3}),
    "perturbed": BenchmarkTask("perturbed", "SnakePerturbed-v1"),
    "maze": BenchmarkTask("maze", "SnakeMaze-v1"),
    "corridor": BenchmarkTask("corridor", "SnakeCorridor-v1"),
    "terrain": BenchmarkTask("terrain", "SnakeTerrain-v1"),
}
"""The tasks that have a difficulty; "solvable" are fields with three push-points in every body length."""
PLANAR = tuple(name for name, task in FAMILIES.items() if task.model == "planar")
DIFFICULTIES = (0.0, 0.25, 0.5, 0.75, 1.0)
PASSED = 0.8
"""Success rate from which a level counts as reached."""

Curve = list[Estimate]


@dataclass
class Options:
    """What is measured.

    Args:
        tasks: Names.
        policies: Names or files.
        robot_class: "ideal" or "aiko"; None: as the tasks are.
        difficulties: In [0, 1].
        fields: Held-out episodes at each difficulty.
        num_threads: Threads of the simulator.
        picture: PNG file.
    """

    tasks: tuple[str, ...] = PLANAR
    policies: tuple[str, ...] = (GAIT,)
    robot_class: str | None = None
    difficulties: tuple[float, ...] = DIFFICULTIES
    fields: Count = 500
    num_threads: int | None = None
    picture: Path = Path("runs/difficulty.png")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Prints and draws the curves of the policies in the tasks."""
    for name in args.tasks:
        if name not in FAMILIES:
            raise ConfigError("task", name, f"one of {', '.join(FAMILIES)}")
    curves = {}
    for policy in args.policies:
        for name in args.tasks:
            label = name if len(args.policies) == 1 else f"{policy}, {name}"
            curves[label] = measure(policy, tasks.judged(FAMILIES[name], args.robot_class), args)
    print(rates(curves, args.difficulties))
    args.picture.parent.mkdir(parents=True, exist_ok=True)
    print(draw(curves, args.difficulties, args.picture))
    return 0


def measure(policy: str, task: BenchmarkTask, args: Options) -> Curve:
    """Success rate of a policy in a family, difficulty by difficulty; scripted controllers as tuned for the family."""
    player, curve = load_policy(policy, task=task.name), []
    for difficulty in args.difficulties:
        given = task.options | {"difficulty": difficulty}
        episodes = run_episodes(player, task.env_id, seeds.held_out(args.fields), args.num_threads, **given)
        curve.append(mean_interval(episodes["is_success"].astype(float)))
    return curve


def level(curve: Curve, difficulties: tuple[float, ...]) -> str:
    """The highest difficulty that is passed as all easier ones are; a dash where not even the easiest is."""
    reached = "-"
    for difficulty, one in sorted(zip(difficulties, curve, strict=True), key=lambda row: row[0]):
        if one.value < PASSED:
            break
        reached = f"{difficulty:g}"
    return reached


def rates(curves: dict[str, Curve], difficulties: tuple[float, ...]) -> str:
    """Success rates with their 95 % confidence intervals, and the levels reached, as Markdown."""
    rows = {
        name: [*(f"{one.value:.2f} [{one.low:.2f}, {one.high:.2f}]" for one in curve), level(curve, difficulties)]
        for name, curve in curves.items()
    }
    head = ["task", *(f"{difficulty:g}" for difficulty in difficulties), "level"]
    return table(head, ([name, *cells] for name, cells in rows.items()))


def draw(curves: dict[str, Curve], difficulties: tuple[float, ...], path: Path) -> Path:
    """Success over difficulty, one line per curve."""
    with drawing.style():
        drawn, axes = drawing.figure(1, 1, 5.0, 3.0)
        for name, curve in curves.items():
            spread = [one.value - one.low for one in curve], [one.high - one.value for one in curve]
            axes[0, 0].errorbar(difficulties, [one.value for one in curve], spread, capsize=2, label=name)
        axes[0, 0].set(xlabel="difficulty", ylabel="success", ylim=(0.0, 1.05))
        axes[0, 0].legend(fontsize=7)
        return drawing.save(drawn, path)


if __name__ == "__main__":
    sys.exit(main())
