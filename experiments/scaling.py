"""The cost of the parts of a training step, measured on one core.

    python -m experiments.scaling --config field-hard --write docs/scaling.md

Measured in CPU time of one thread: collecting (simulator and policy), learning, handing a rollout from process to
process. They show how many collecting cores keep one learner busy.
"""

from __future__ import annotations

import pickle
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch

from snake_env._files import write_text
from training import config as configs
from training.cli import answer
from training.config import PpoConfig
from training.learners import ppo
from training.learners.collector import ARRAYS

HEADING = "## The cost of a training step"
REPETITIONS = 3


@dataclass(frozen=True)
class Parts:
    """CPU time of one core, and sizes.

    Args:
        collect: per step of a robot: simulator and policy [s].
        learn: per step, in all epochs of an update [s].
        hand_over: per record of a step, through pickle and back [s].
        record: size of a step's record [bytes].
        weights: size of the networks [bytes].
        gradients: gradient steps per update.
    """

    collect: float
    learn: float
    hand_over: float
    record: float
    weights: float
    gradients: int


def measure(config: PpoConfig) -> Parts:
    """Measures the parts on one thread, medians of some repetitions."""
    torch.set_num_threads(1)
    config = config.with_changes(num_threads=1)
    learner = ppo.Learner(config, 0, lambda *episode: None)
    learner.collect()
    learner.learn(0.0)
    collect = seconds(learner.collect)
    learn = seconds(lambda: learner.learn(0.0))
    rollout = learner.collector.rollout
    arrays = {name: getattr(rollout, name) for name in ARRAYS}
    record = pickle.dumps(arrays, protocol=5)
    hand_over = seconds(lambda: pickle.loads(pickle.dumps(arrays, protocol=5)))
    steps = rollout.reward.size
    learner.collector.close()
    return Parts(
        collect=collect / steps,
        learn=learn / steps,
        hand_over=hand_over / steps,
        record=len(record) / steps,
        weights=sum(weight.numel() * weight.element_size() for weight in learner.agent.parameters()),
        gradients=config.ppo.n_epochs * -(-steps // config.ppo.batch_size),
    )


def seconds(work: Callable[[], object]) -> float:
    """CPU time of this process [s], median of repetitions."""
    taken = []
    for _ in range(REPETITIONS):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    return statistics.median(taken)


def page(parts: Parts, name: str) -> str:
    """The measured parts as Markdown."""
    return f"""{HEADING}

Measured on one core by `python -m experiments.scaling --config {name}`, per step of one robot:

| part | |
| --- | --- |
| collect: simulator and policy | {1e6 * parts.collect:.1f} us |
| learn: all epochs of an update | {1e6 * parts.learn:.1f} us |
| pass a record between processes | {1e6 * parts.hand_over:.2f} us |
| size of a record | {parts.record:.0f} bytes |
| weights of both networks | {parts.weights / 1e3:.0f} kB, {parts.gradients} gradient steps per update |

One learning core is busy with {parts.collect / parts.learn:.1f} collecting cores, so the learner is the first
bottleneck: beyond a handful of cores the update has to be [shared](#sharing-the-update), or each sample has to be used
less often (larger batches, fewer epochs), which depends on what the task tolerates. Rates on many cores have not been
measured.
"""


@dataclass
class Options:
    """What is measured.

    Args:
        config: File or name in training/configs.
        write: A page whose last section is replaced.
    """

    config: Path = Path("field-hard")
    write: Path | None = None


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, write, __doc__, arguments)


def write(args: Options) -> int:
    """Prints the section, and puts it in its page."""
    section = page(measure(configs.load_as(PpoConfig, args.config)), args.config.stem)
    print(section)
    if args.write is not None:
        kept = args.write.read_text().split(HEADING)[0]
        write_text(args.write, kept + section)
    return 0


if __name__ == "__main__":
    sys.exit(main())
