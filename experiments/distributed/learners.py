"""PPO whose update is shared: several processes of one machine, each with its robots and its part of every minibatch.

    python -m experiments.distributed.learners --learners 2 --config field-hard --out runs/field

Everything but communication is ``training/learners/ppo.py``. Each process steps its share of the robots; of every
minibatch it takes the samples of its own robots, and torch's DistributedDataParallel makes the mean of the gradients
over gloo. Seeds and exploration noise belong to robots, the order of samples to the run, and advantages are scaled over
the whole minibatch: the run is that of one learner, within round-off, which contacts amplify in the course of a run. A
checkpoint has all robots, so that a run may be continued with another number of learners, or with one. Ctrl-C saves and
stops; if a process ends by itself, all do, and --resume continues from the latest checkpoint.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType

import torch.multiprocessing as mp
from torch.multiprocessing.spawn import ProcessContext, ProcessException

from experiments.distributed.group import GlooGroup, SharedCollector
from snake_env import ConfigError
from training.config import Count, PpoConfig, load_as
from training.learners import ppo
from training.runs import RunFolder
from training.train import Options, command


@dataclass
class SharedOptions(Options):
    """Which run, and among how many.

    Args:
        learners: Processes, each with an equal share of the robots and --num-threads threads for them.
    """

    learners: Count = 2


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget is used up, 130 when it was stopped, 1 when a process was lost."""
    return command(SharedOptions, __doc__, arguments, lambda one: load_as(PpoConfig, one.config), train)


def train(options: SharedOptions, folder: RunFolder, config: PpoConfig) -> int:
    """Starts the processes; returns when they have ended."""
    if options.learners < 1 or config.num_envs % options.learners:
        raise ConfigError("learners", options.learners, f"a divisor of num_envs = {config.num_envs}")
    if config.behaviour_cloning is not None and config.behaviour_cloning.run is not None:
        raise ConfigError(
            "behaviour_cloning.run", config.behaviour_cloning.run, "none: train it first, and name its policy"
        )
    with tempfile.TemporaryDirectory() as scratch:
        given = (options.learners, Path(scratch), folder.path, config, options.bar)
        processes = mp.start_processes(work, given, options.learners, join=False, start_method="spawn")
        assert isinstance(processes, ProcessContext)
        with Forwarding(processes):
            try:
                while not processes.join():
                    pass
            except ProcessException as error:
                print(f"a learner ended: {str(error).strip().splitlines()[-1]}", file=sys.stderr)
                return 1
    return 0 if folder.finished else 130


class Forwarding:
    """Makes all processes stop on Ctrl-C or a termination signal.

    Args:
        processes: all of them.
    """

    def __init__(self, processes: ProcessContext) -> None:
        self._processes = processes

    def __enter__(self) -> None:
        self._before = {number: signal.signal(number, self._forward) for number in (signal.SIGINT, signal.SIGTERM)}

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _forward(self, number: int, frame: FrameType | None) -> None:
        for process in self._processes.processes:
            process.terminate()


def work(rank: int, size: int, scratch: Path, path: Path, config: PpoConfig, show: bool) -> None:
    """One of the processes; only the first writes into the folder of the run."""
    parent = os.getppid()

    def interrupted(number: int, frame: FrameType | None) -> None:
        """The terminal's Ctrl-C, which the parent forwards, or torch's signal that the parent has ended."""
        if os.getppid() != parent:
            sys.exit(1)

    signal.signal(signal.SIGINT, interrupted)
    folder = RunFolder(path)
    if rank > 0:
        folder = Follower(scratch / str(rank), folder)
        config = config.with_changes(evaluations=0, track="none")
        folder.create(config)
    with GlooGroup(rank, size, scratch / "meeting", config.num_envs) as group:
        ppo.train(folder, config, show and rank == 0, partial(SharedCollector, group=group), group)


class Follower(RunFolder):
    """The folder of a process other than the first: it continues from the first one's checkpoints, and is temporary.

    Args:
        path: A temporary folder.
        first: Folder of the run.
    """

    def __init__(self, path: Path, first: RunFolder) -> None:
        super().__init__(path)
        self._first = first

    def latest(self) -> Path | None:
        """The checkpoint of the run after the most steps."""
        return self._first.latest()


if __name__ == "__main__":
    sys.exit(main())
