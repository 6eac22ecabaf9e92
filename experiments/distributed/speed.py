"""Wall time of an update with one and with several learners on this machine, and where it goes.

    python -m experiments.distributed.speed --config field-hard --learners 1 2

Each learner is a process with a share of the robots, one thread for them and one for torch, as in
``experiments/distributed/learners.py``. Rates are environment steps of all robots per second of wall time, medians over
updates of the first learner; its shares are those of the simulator, of acting (inference, bookkeeping and waiting for
the others' rollouts) and of the update, communication included. Turns of all numbers of learners alternate, so that
other work on the machine weighs on all alike. Prints a table in Markdown.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import torch
import torch.multiprocessing as mp

from experiments.distributed.group import GlooGroup, SharedCollector
from snake_env.markdown import table
from training import config as configs
from training.cli import answer
from training.config import Count, PpoConfig
from training.learners.ppo import Learner

PARTS = ("simulator", "acting", "update")


@dataclass
class Options:
    """What is measured.

    Args:
        config: File or name in training/configs.
        learners: Numbers of processes.
        updates: In each turn, after one that does not count.
        turns: Of each number of processes.
    """

    config: Path = Path("field-hard")
    learners: tuple[Count, ...] = (1, 2)
    updates: Count = 8
    turns: Count = 3


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Measures and prints."""
    config = configs.load_as(PpoConfig, args.config).with_changes(num_threads=1, torch_threads=1)
    rows: dict[int, list[list[float]]] = {size: [] for size in args.learners}
    for _ in range(args.turns):
        for size, found in rows.items():
            found.extend(measured(config, size, args.updates))
    steps = config.ppo.n_steps * config.num_envs
    rates = {size: steps / statistics.median(sum(row) for row in found) for size, found in rows.items()}
    lines = []
    for size, found in rows.items():
        seconds = [statistics.median(row[k] for row in found) for k in range(len(PARTS))]
        shares = [f"{one / sum(seconds):.2f}" for one in seconds]
        lines.append([size, f"{rates[size]:,.0f}", f"{rates[size] / rates[args.learners[0]]:.2f}", *shares])
    print(table(["learners", "steps per second", "times the first", *PARTS], lines))
    return 0


def measured(config: PpoConfig, size: int, updates: int) -> list[list[float]]:
    """Seconds of each part, update by update, of the first of so many learners."""
    with tempfile.TemporaryDirectory() as scratch:
        given = (size, Path(scratch), config, updates)
        mp.start_processes(work, given, size, start_method="spawn")
        found: list[list[float]] = json.loads((Path(scratch) / "seconds.json").read_text())
        return found


def work(rank: int, size: int, scratch: Path, config: PpoConfig, updates: int) -> None:
    """One of the learners; the first notes its times."""
    torch.set_num_threads(1)
    found = []
    with GlooGroup(rank, size, scratch / "meeting", config.num_envs) as group:
        make = partial(SharedCollector, group=group)
        learner = Learner(config, 0, lambda *episode: None, make=make, group=group)
        for _ in range(updates + 1):
            before, start = learner.simulator_seconds, time.perf_counter()
            learner.collect()
            collected = time.perf_counter()
            learner.learn(0.0)
            simulating = learner.simulator_seconds - before
            found.append([simulating, collected - start - simulating, time.perf_counter() - collected])
        learner.close()
    if rank == 0:
        (scratch / "seconds.json").write_text(json.dumps(found[1:]))


if __name__ == "__main__":
    sys.exit(main())
