"""What configurations are worth over the seeds of a sweep: means, spread, differences seed by seed.

    python -m training.search.sweep --configs field-hard-mirrored,field-hard-mirrored-blind --seeds 5 --out runs/sweep
    python -m experiments.seed_statistics --sweep runs/sweep --configs field-hard-mirrored,field-hard-mirrored-blind

Plays the policy that each finished seed left, on held-out fields of its own task, the same for all, and keeps what was
played under ``cells/``: after Ctrl-C, or with more seeds, the same command goes on. Prints Markdown:
mean and sample standard deviation over the seeds, and each seed's score; and of the first configuration against each
other one the mean difference between equal seeds, with Student's 95 % interval over the seeds. Writes
``seed-table.json`` and, with matplotlib, ``learning-curves.png``: median and range over the seeds.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from snake_env import ConfigError, _markdown
from training import seeds
from training.cli import answer, help_format, names
from training.evaluation import cached_scores
from training.evaluation.benchmark import Benchmark
from training.learners import ppo
from training.runs import RunFolder, versions, write_json
from training.search import sweep
from training.tasks import BenchmarkTask

FIELDS = 500
SCORES = {"is_success": "success", "speed": "speed [m/s]"}
STUDENT = {2: 12.706, 3: 4.303, 4: 3.182, 5: 2.776, 6: 2.571, 7: 2.447, 8: 2.365, 9: 2.306, 10: 2.262}
"""Half width of Student's two-sided 95 % interval by number of seeds, in standard errors of the mean."""

Table = dict[str, dict[str, float]]
"""By score and run."""


class Spread(NamedTuple):
    """Mean and sample standard deviation over seeds; the latter is zero for one seed."""

    mean: float
    deviation: float

    @classmethod
    def of(cls, each: Iterable[float]) -> Spread:
        """Of one value a seed."""
        values = list(each)
        return cls(statistics.mean(values), statistics.stdev(values) if len(values) > 1 else 0.0)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("experiments.seed_statistics", description=__doc__, formatter_class=help_format)
    cli.add_argument("--sweep", type=Path, default=Path("runs/sweep"), help="folder of the sweep")
    cli.add_argument("--configs", type=names, required=True, help="folders in it, comma separated")
    cli.add_argument("--fields", type=int, default=FIELDS, help="number of held-out fields")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, default=Path("runs/seed-table"), help="folder for JSON and picture")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), compare, arguments)


def compare(args: argparse.Namespace) -> int:
    """Judges the seeds of all configurations; prints and writes the table."""
    folders = {name: finished(args.sweep / name) for name in args.configs}
    bench = Benchmark(args.out, seeds.held_out(args.fields), args.num_threads)
    tables = {name: judge(found, bench) for name, found in folders.items()}
    print(text(tables))
    args.out.mkdir(parents=True, exist_ok=True)
    write_json(args.out / "seed-table.json", {"fields": args.fields, "versions": versions(), "scores": tables})
    sweep.draw(folders, args.out)
    return 0


def finished(path: Path) -> list[RunFolder]:
    """The finished runs of a configuration, by seed.

    Raises:
        ConfigError: there are none.
    """
    paths = sorted(path.glob("seed-*"), key=lambda one: int(one.name.removeprefix("seed-")))
    found = [RunFolder(one, ppo.POLICY, ".pt") for one in paths]
    done = [folder for folder in found if folder.finished]
    if not done:
        raise ConfigError("configs", path.name, f"one with finished runs in {path}/seed-<k>")
    return done


def judge(folders: list[RunFolder], bench: Benchmark) -> Table:
    """Plays each run's policy on the benchmark's fields of the run's task; what has been played is kept."""
    played = {}
    for folder in folders:
        config, name = folder.config(), folder.path.name
        task = BenchmarkTask(folder.path.parent.name, config.env_id, config.env, config.about)
        played[name] = bench.cell(task, cached_scores.trained(name, folder.model, None))
    return {
        title: {name: float(episodes[signal].mean()) for name, episodes in played.items()}
        for signal, title in SCORES.items()
    }


def text(tables: dict[str, Table]) -> str:
    """A Markdown table of the configurations, and a sentence for each but the first."""
    heads = ["configuration", *(f"{title}: mean (sd)" for title in SCORES.values())]
    heads += [f"{title}, seed by seed" for title in SCORES.values()]
    lines = []
    for name, table in tables.items():
        means = ["{:.3f} ({:.3f})".format(*Spread.of(of.values())) for of in table.values()]
        lines.append([f"`{name}`", *means, *(", ".join(f"{one:.3f}" for one in of.values()) for of in table.values())])
    first, *others = tables
    return "\n".join(
        [_markdown.table(heads, lines), "", *(against(tables[first], tables[other], first, other) for other in others)]
    )


def against(table: Table, reference: Table, name: str, other: str) -> str:
    """One sentence about the difference of two configurations between the seeds that both have."""
    parts = []
    if not set(table["success"]) & set(reference["success"]):
        return f"{name} and {other} have no seed in common."
    for title, of in table.items():
        differences = [of[run] - value for run, value in reference[title].items() if run in of]
        mean, deviation = Spread.of(differences)
        if len(differences) < 2:
            parts.append(f"{title} {mean:+.3f}, one seed")
            continue
        half = STUDENT.get(len(differences), float("nan")) * deviation / len(differences) ** 0.5
        parts.append(f"{title} {mean:+.3f} [{mean - half:+.3f}, {mean + half:+.3f}]")
    return f"{name} against {other}, seed by seed: " + ", ".join(parts) + "."


if __name__ == "__main__":
    sys.exit(main())
