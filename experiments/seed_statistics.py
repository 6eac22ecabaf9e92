"""What configurations are worth over the seeds of a sweep: means, spread, differences seed by seed.

    python -m training sweep --configs corridor-cloned field-hard-symmetric --seeds 5 --out runs/sweep
    python -m experiments.seed_statistics --sweep runs/sweep --configs corridor-cloned field-hard-symmetric

Plays the policy that each finished seed left, on held-out fields of its own task, or of a task of the benchmark, the
same for all, and caches the scores: after Ctrl-C, or with more seeds, the same command continues. Prints Markdown:
mean, sample standard deviation and interquartile mean with its bootstrap interval over the seeds; and of the first
configuration against each other one the mean difference between equal seeds with Student's 95 % interval, and the
probability that one of its seeds is the better (Agarwal et al. 2021). Writes ``seed-statistics.json`` and
``learning-curves.png``.
"""

from __future__ import annotations

import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snake_env import ConfigError
from snake_env._files import write_json
from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.statistics import interquartile_mean, probability_of_improvement, student_interval
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.markdown import table
from training.cli import answer
from training.config import Count
from training.evaluation import cached_scores
from training.runs import RunFolder, versions
from training.search import sweep

FIELDS = 500
SCORES = {"is_success": "success", "speed": "speed [m/s]"}

Table = dict[str, dict[str, float]]
"""By score and run."""


@dataclass
class Options:
    """What is compared.

    Args:
        sweep: Folder of the sweep.
        configs: Folders in it.
        task: Task of the benchmark in which all play; by default each plays in its own.
        best: Play the policy of each seed that was best on validation fields during training, not the last one.
        fields: Number of held-out fields.
        num_threads: Threads of the simulator.
        out: Folder for JSON and picture.
    """

    configs: tuple[str, ...]
    sweep: Path = Path("runs/sweep")
    task: str | None = None
    best: bool = False
    fields: Count = FIELDS
    num_threads: int | None = None
    out: Path = Path("runs/seed-statistics")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Scores the seeds of all configurations; prints and writes the table."""
    folders = {name: finished(args.sweep / name) for name in args.configs}
    bench = cached_scores.Bench(args.out, seeds.held_out(args.fields), args.num_threads)
    task = None if args.task is None else tasks.chosen([args.task])[0]
    tables = {name: score(found, bench, task, args.best) for name, found in folders.items()}
    print(text(tables))
    args.out.mkdir(parents=True, exist_ok=True)
    write_json(
        args.out / "seed-statistics.json",
        {"task": args.task, "fields": args.fields, "versions": versions(), "scores": tables},
    )
    sweep.draw(folders, args.out)
    return 0


def finished(path: Path) -> list[RunFolder]:
    """The finished runs of a configuration, by seed.

    Raises:
        ConfigError: there are none.
    """
    paths = sorted(path.glob("seed-*"), key=lambda one: int(one.name.removeprefix("seed-")))
    found = [RunFolder(one) for one in paths]
    done = [folder for folder in found if folder.finished]
    if not done:
        raise ConfigError("configs", path.name, f"one with finished runs in {path}/seed-<k>")
    return done


def score(
    folders: list[RunFolder], bench: cached_scores.Bench, task: BenchmarkTask | None = None, best: bool = False
) -> Table:
    """Plays each run's policy on the benchmark's fields of a task; None: of its own. What has been played is kept."""
    played = {}
    for folder in folders:
        config, name = folder.config(), folder.path.name
        own = BenchmarkTask(folder.path.parent.name, config.env_id, config.env, config.about)
        policy = folder.chosen if best else folder.policy
        played[name] = bench.episodes(task or own, cached_scores.trained(name, policy))
    return {
        title: {name: float(episodes[signal].mean()) for name, episodes in played.items()}
        for signal, title in SCORES.items()
    }


def text(tables: dict[str, Table]) -> str:
    """A Markdown table of the configurations, and a sentence for each but the first."""
    heads = ["configuration"]
    for title in SCORES.values():
        heads += [f"{title}: mean (sd)", "interquartile mean", "seed by seed"]
    lines = []
    for name, of_name in tables.items():
        cells = []
        for of_seed in of_name.values():
            values = list(of_seed.values())
            deviation = statistics.stdev(values) if len(values) > 1 else 0.0
            middle = interquartile_mean(values)
            cells.append(f"{statistics.mean(values):.3f} ({deviation:.3f})")
            cells.append(f"{middle.value:.3f} [{middle.low:.3f}, {middle.high:.3f}]")
            cells.append(", ".join(f"{value:.3f}" for value in values))
        lines.append([f"`{name}`", *cells])
    first, *others = tables
    sentences = [against(tables[first], tables[other], first, other) for other in others]
    return "\n".join([table(heads, lines), "", *sentences])


def against(scores: Table, reference: Table, name: str, other: str) -> str:
    """One sentence about the differences of two configurations: between equal seeds, and of any two seeds."""
    if not set(scores["success"]) & set(reference["success"]):
        return f"{name} and {other} have no seed in common."
    parts = []
    for title, of_seed in scores.items():
        difference = student_interval(
            [of_seed[run] - value for run, value in reference[title].items() if run in of_seed]
        )
        if np.isnan(difference.low):
            parts.append(f"{title} {difference.value:+.3f}, one seed")
            continue
        better = probability_of_improvement([list(of_seed.values())], [list(reference[title].values())])
        interval = f"[{difference.low:+.3f}, {difference.high:+.3f}]"
        parts.append(f"{title} {difference.value:+.3f} {interval}, better with probability {better.value:.2f}")
    return f"{name} against {other}, seed by seed: " + "; ".join(parts) + "."


if __name__ == "__main__":
    sys.exit(main())
