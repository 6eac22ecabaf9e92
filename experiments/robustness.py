"""What randomised friction, mass, delay and backlash cost, and what training with them gains.

    python -m training sweep --configs general-randomised --seeds 5 --jobs 1 --fields 100 --out runs/sweep
    python -m experiments.robustness --sweep runs/sweep --config general-randomised

Plays a shipped policy and each finished seed of a configuration in every task of the configuration, on held-out fields:
with the parameters as they are, and randomised as in training. Episodes are cached: after Ctrl-C the same command
continues. Prints Markdown, writes ``robustness.json``.
"""

from __future__ import annotations

import statistics
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from experiments.seed_statistics import finished
from snake_env._files import write_json
from snake_env.errors import ConfigError
from snake_env.evaluation import scores, seeds
from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.markdown import table
from snake_env.policies.shipped import policy_path
from training.cli import answer
from training.config import Count, RunConfig
from training.evaluation import cached_scores
from training.runs import versions

Condition = Literal["nominal", "randomised"]
CONDITIONS: tuple[Condition, ...] = ("nominal", "randomised")


@dataclass
class Options:
    """What is played.

    Args:
        sweep: Folder of the sweep.
        config: Folder in it.
        against: The shipped policy, which was trained without randomisation.
        fields: Held-out fields of each task.
        tasks: Of the configuration; all if empty.
        conditions: Whether nominal, randomised or both.
        num_threads: Threads of the simulator.
        out: Folder for everything.
    """

    sweep: Path = Path("runs/sweep")
    config: str = "general-randomised"
    against: str = "general"
    fields: Count = 500
    tasks: tuple[str, ...] = ()
    conditions: tuple[Condition, ...] = CONDITIONS
    num_threads: int | None = None
    out: Path = Path("runs/robustness")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Plays everything, prints and writes the table."""
    folders = finished(args.sweep / args.config)
    bench = cached_scores.Bench(args.out, seeds.held_out(args.fields), args.num_threads)
    before = cached_scores.trained(args.against, policy_path(args.against))
    after = [cached_scores.trained(folder.path.name, folder.policy) for folder in folders]
    found: dict[str, dict[str, Any]] = {}
    for condition in args.conditions:
        for task in tasks(folders[0].config(), condition == "randomised", args.tasks):
            played = {entry.name: bench.episodes(task, entry) for entry in [before, *after]}
            print(condition, task.name, *(f"{one['is_success'].mean():.3f}" for one in played.values()), flush=True)
            found.setdefault(task.name, {})[condition] = {name: means(one) for name, one in played.items()}
    print(text(found, args.against, args.config))
    args.out.mkdir(parents=True, exist_ok=True)
    write_json(args.out / "robustness.json", {"fields": args.fields, "versions": versions(), "tasks": found})
    return 0


def tasks(config: RunConfig, randomised: bool, chosen: tuple[str, ...] = ()) -> list[BenchmarkTask]:
    """The tasks of a run, or some of them, with or without the randomisation of its environments.

    Raises:
        ConfigError: the run has no such task.
    """
    environments = config.environments()
    known = [name for name, _, _ in environments]
    for name in chosen:
        if name not in known:
            raise ConfigError("tasks", repr(name), f"some of {', '.join(known)}")
    return [
        BenchmarkTask(name, env_id, {key: of[key] for key in of if randomised or key != "randomization"})
        for name, env_id, of in environments
        if name in (chosen or known)
    ]


def means(episodes: Episodes) -> dict[str, float]:
    """Success rate and speed [m/s], and the ends of the interval of the first."""
    row = scores.score(episodes)
    success = row["success"]
    return {"success": success.value, "low": success.low, "high": success.high, "speed": row["speed"].value}


def text(found: dict[str, dict[str, Any]], before: str, after: str) -> str:
    """A row per task, two columns per condition: the policy before, and the seeds after."""
    heads = ["task"]
    conditions = next(iter(found.values()))
    for condition in conditions:
        heads += [f"{condition}, `{before}`", f"{condition}, `{after}`", f"{condition}, speeds [m/s]"]
    lines = []
    for task, of_task in found.items():
        cells = [f"`{task}`"]
        for condition in conditions:
            of_before, *of_seeds = of_task[condition].values()
            speed = statistics.mean(row["speed"] for row in of_seeds)
            cells += [_success(of_before), _successes(of_seeds), f"{of_before['speed']:.3f}, {speed:.3f}"]
        lines.append(cells)
    return table(heads, lines)


def _success(row: dict[str, float]) -> str:
    return f"{row['success']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"


def _successes(rows: list[dict[str, float]]) -> str:
    """Mean and standard deviation over seeds and the least; of a single seed its interval over scenes."""
    if len(rows) == 1:
        return _success(rows[0])
    values = [row["success"] for row in rows]
    return f"{statistics.mean(values):.3f} ({statistics.stdev(values):.3f}), least {min(values):.3f}"


if __name__ == "__main__":
    sys.exit(main())
