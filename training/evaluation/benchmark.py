"""The benchmark: every task, every policy, on fields on which nothing was trained or tuned.

    python -m training benchmark
    python -m training benchmark --tasks field-hard --policies "thesis gait" "heading control" --episodes 100
    python -m training benchmark --policy mine=runs/field/policy.safetensors --tasks field-hard

Tasks are those of ``snake_env/evaluation/tasks.json``; policies, scripted and trained, those of
``training/configs/benchmark.json`` and of --policy; scripted controllers play where they have been tuned. Episode k of
every policy is on field k. Writes ``benchmark.json``, ``benchmark.md`` and pictures; the same command gives the same
files, bit for bit. Episodes are cached and not played again as long as task, policy and simulator are the same: after
Ctrl-C the same command continues.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.interface import title
from training.cli import answer
from training.config import Count
from training.evaluation import benchmark_page, cached_scores
from training.evaluation.cached_scores import Entry

EPISODES = 500


def named_path(text: str) -> tuple[str, Path]:
    """NAME=PATH, or PATH, which has its :func:`snake_env.policies.title`."""
    name, equals, path = text.rpartition("=")
    return (name, Path(path)) if equals else (title(Path(text)), Path(text))


@dataclass
class Options:
    """What is played.

    Args:
        tasks: Names; all if absent.
        policies: Of the configuration; all if absent.
        policy: One more, as NAME=PATH or PATH; may be repeated.
        episodes: Of each policy in each task.
        config: JSON file with the policies.
        num_threads: Threads of the simulator.
        out: Folder for everything.
        write_docs: Also write docs/learning-benchmark.* and its pictures; tasks that are not chosen stay as they are.
    """

    tasks: tuple[str, ...] | None = None
    policies: tuple[str, ...] | None = None
    policy: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    episodes: Count = EPISODES
    config: Path = cached_scores.CONFIG
    num_threads: int | None = None
    out: Path = Path("runs/benchmark")
    write_docs: bool = False


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, play, __doc__, arguments)


def play(args: Options) -> int:
    """Plays what is not cached and writes the page; 130 when it was stopped."""
    chosen = tasks.chosen(args.tasks)
    entries = cached_scores.entries(args.config, args.policies, [named_path(one) for one in args.policy])
    bench = Benchmark(args.out, seeds.held_out(args.episodes), args.num_threads)
    try:
        bench.play(chosen, entries)
    except KeyboardInterrupt:
        print("\nstopped; finished episodes are kept, the same command continues")
        return 130
    pages = benchmark_page.write(bench.played, chosen, args.episodes, args.out)
    if args.write_docs:
        docs = benchmark_page.DOCS
        benchmark_page.write(bench.played, chosen, args.episodes, docs, "learning-benchmark", "images", keep=True)
    print(pages.read_text())
    return 0


@dataclass
class Benchmark:
    """Plays policies in tasks, or takes their episodes from the cache.

    Args:
        out: folder.
        fields: seeds, one per episode; all of them held out.
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
            episodes = self.episodes(task, entry)
            self.played.setdefault(task.name, {})[entry.name] = episodes
            print(f"success {episodes['is_success'].mean():.3f} ({time.monotonic() - start:.1f} s)", flush=True)

    def episodes(self, task: BenchmarkTask, entry: Entry) -> Episodes:
        """Episodes of a policy in a task."""
        return cached_scores.scores(self.out, task, entry, self.fields, self.num_threads)


if __name__ == "__main__":
    sys.exit(main())
