"""The benchmark: every task, every policy, on fields that nothing was trained or tuned on.

    python -m training.evaluation.benchmark
    python -m training.evaluation.benchmark --tasks field-hard --policies "thesis gait,heading control" --episodes 100
    python -m training.evaluation.benchmark --policy mine=runs/field/policy.safetensors --tasks field-hard

Tasks are those of ``training/configs/tasks.json``; policies, scripted and trained, those of
``training/configs/benchmark.json`` and of ``--policy``; scripted controllers play where they have been tuned. Episode k
of every policy is on field k. Writes ``benchmark.json``, ``benchmark.md`` and pictures; the same command gives the same
files, bit for bit. Each cell of the table is kept under ``cells/`` and is not played again as long as task, policy and
simulator are the same: after Ctrl-C the same command goes on.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from training import seeds, tasks
from training.cli import answer, help_format, names
from training.evaluation import benchmark_page, cached_scores
from training.evaluation.cached_scores import Entry
from training.policies.interface import title
from training.rollout import Episodes
from training.tasks import BenchmarkTask

EPISODES = 500
WRITE_DOCS = "also write docs/learning-benchmark.* and its pictures; tasks that are not chosen stay as they are there"


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.evaluation.benchmark", description=__doc__, formatter_class=help_format)
    cli.add_argument("--tasks", type=names, help="comma separated; all if absent")
    cli.add_argument("--policies", type=names, help="of the configuration, comma separated; all if absent")
    cli.add_argument(
        "--policy",
        type=named_path,
        action="append",
        default=[],
        help="one more: a policy.safetensors or model.zip, as NAME=PATH or PATH; may be repeated",
    )
    cli.add_argument("--episodes", type=int, default=EPISODES, help="of each policy in each task")
    cli.add_argument("--config", type=Path, default=cached_scores.CONFIG, help="JSON file with the policies")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, default=Path("runs/benchmark"), help="folder for everything")
    cli.add_argument("--write-docs", action="store_true", help=WRITE_DOCS)
    return cli


def named_path(text: str) -> tuple[str, Path]:
    """NAME=PATH, or PATH, which has its :func:`policies.title`."""
    name, equals, path = text.rpartition("=")
    return (name, Path(path)) if equals else (title(Path(text)), Path(text))


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 130 when it was stopped, 2 when a task or policy does not exist."""
    return answer(parser(), play, arguments)


def play(args: argparse.Namespace) -> int:
    """Plays the cells and writes the page; 130 when it was stopped."""
    chosen = tasks.chosen(args.tasks)
    entries = cached_scores.entries(args.config, args.policies, args.policy)
    bench = Benchmark(args.out, seeds.held_out(args.episodes), args.num_threads)
    try:
        bench.play(chosen, entries)
    except KeyboardInterrupt:
        print("\nstopped; finished cells stay, the same command goes on")
        return 130
    pages = benchmark_page.write(bench.played, chosen, args.episodes, args.out)
    if args.write_docs:
        docs = benchmark_page.DOCS
        benchmark_page.write(bench.played, chosen, args.episodes, docs, "learning-benchmark", "images", keep=True)
    print(pages.read_text())
    return 0


@dataclass
class Benchmark:
    """Plays cells, or takes them from the folder.

    Args:
        out: folder.
        fields: seeds, one an episode; all of them held out.
        num_threads: threads of the simulator.
        played: episodes by task and policy.
    """

    out: Path
    fields: list[int]
    num_threads: int | None = None
    played: dict[str, dict[str, Episodes]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        seeds.require_held_out(self.fields)

    def play(self, chosen: list[BenchmarkTask], entries: list[Entry]) -> None:
        """Fills ``played``."""
        pairs = [(task, entry) for task in chosen for entry in entries if entry.plays(task)]
        for number, (task, entry) in enumerate(pairs, 1):
            start = time.monotonic()
            print(f"[{number}/{len(pairs)}] {task.name}, {entry.name}: ", end="", flush=True)
            episodes = self.cell(task, entry)
            self.played.setdefault(task.name, {})[entry.name] = episodes
            print(f"success {episodes['is_success'].mean():.3f} ({time.monotonic() - start:.1f} s)", flush=True)

    def cell(self, task: BenchmarkTask, entry: Entry) -> Episodes:
        """Episodes of a policy in a task."""
        path = cached_scores.path(self.out, task, entry, self.fields)
        if not path.exists():
            cached_scores.write(path, cached_scores.play(task, entry, self.fields, self.num_threads))
        return cached_scores.read(path)


if __name__ == "__main__":
    sys.exit(main())
