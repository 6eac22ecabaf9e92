"""What many cores would give: measures the parts of a training step on one, and puts them together on paper.

    python -m experiments.scaling --config field-hard --write docs/scaling.md

Measured in CPU time of one thread: collecting (simulator and policy), learning, handing a rollout and the weights
from process to process. From these the rates of two ways to share the work: actors that collect for one learner
(``experiments/distributed/ppo.py``), and equal workers that each collect, learn, and average their gradients.
"""

from __future__ import annotations

import argparse
import dataclasses
import pickle
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch

from training import config as configs
from training.cli import answer, help_format
from training.config import Config
from training.learners import ppo

CORES = (1, 2, 16, 64, 256, 1000)
NETWORK = 1.25e9
"""Bandwidth assumed between nodes [bytes/s]: ten gigabits a second."""
REPETITIONS = 3


@dataclass(frozen=True)
class Parts:
    """CPU time of one core, and sizes.

    Args:
        collect: of a step of a robot: simulator and policy [s].
        learn: of a step in all epochs of an update [s].
        hand_over: of a step's record, through pickle and back [s].
        record: size of a step's record [bytes].
        weights: size of the networks [bytes].
        gradients: gradient steps an update.
        steps: steps of an update on one core.
    """

    collect: float
    learn: float
    hand_over: float
    record: float
    weights: float
    gradients: int
    steps: int

    def one_learner(self, cores: int) -> float:
        """Steps a second when all cores collect and one of them learns, an update after a rollout.

        The learner's core takes the records in; the network passes them one after another.
        """
        serial = self.learn + self.hand_over + self.record / NETWORK if cores > 1 else self.learn
        return 1.0 / (self.collect / cores + serial)

    def equal_workers(self, cores: int) -> float:
        """Steps a second when every core collects and learns its own share, and gradients are averaged in a ring.

        A ring passes twice the weights through each link for every gradient step.
        """
        ring = 2.0 * self.weights * self.gradients / NETWORK if cores > 1 else 0.0
        return cores * self.steps / (self.steps * (self.collect + self.learn) + ring)


def measure(config: Config) -> Parts:
    """Measures the parts on one thread, medians of some repetitions."""
    torch.set_num_threads(1)
    config = dataclasses.replace(config, num_threads=1)
    learner = ppo.Learner(config, 0, lambda *episode: None)
    learner.collect()
    learner.learn(0.0)
    collect = seconds(learner.collect)
    learn = seconds(lambda: learner.learn(0.0))
    rollout = learner.collector.rollout
    arrays = {name: getattr(rollout, name) for name in ppo.ROLLOUT}
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
        steps=steps,
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
    """The measured parts and what follows from them, as Markdown."""
    rows = [f"| {n:,} | {parts.one_learner(n):,.0f} | {parts.equal_workers(n):,.0f} |" for n in CORES]
    ring = 1.0 - parts.equal_workers(1000) / (1000 * parts.equal_workers(1))
    latency = parts.gradients * 1e-3 / (parts.steps * (parts.collect + parts.learn))
    bound = 1.0 / (parts.learn + parts.hand_over + parts.record / NETWORK)
    half = parts.collect * bound
    return f"""## What many cores would give

On paper, from parts measured on one core by `python -m experiments.scaling --config {name}`:

| part, each step of a robot | |
| --- | --- |
| collect: simulator and policy | {1e6 * parts.collect:.1f} us |
| learn: all epochs of an update | {1e6 * parts.learn:.1f} us |
| hand a record over between processes | {1e6 * parts.hand_over:.2f} us |
| size of a record | {parts.record:.0f} bytes |
| weights of both networks | {parts.weights / 1e3:.0f} kB, {parts.gradients} gradient steps an update |

| cores | steps/s, actors and one learner | steps/s, equal workers that average gradients |
| --- | --- | --- |
{chr(10).join(rows)}

The first bottleneck is the learner: with more than {half:.1f} cores that collect, one core that learns takes most of
the time, and no number of actors passes {bound:,.0f} steps/s. The records come next, {1e6 * parts.record / NETWORK:.2f}
us each at ten gigabits a second. So beyond a handful of cores learning is shared out as well, as in the last column, or
samples are learned from less often: larger batches, fewer epochs, which is a matter of what the task bears. The last
column has updates grow with the cores. There a ring of {parts.weights / 1e3:.0f} kB of gradients costs
{100.0 * ring:.1f} % at ten gigabits a second; its latency costs more, {100.0 * latency:.0f} % if each of the
{parts.gradients} rings of an update waits a millisecond.
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("experiments.scaling", description=__doc__, formatter_class=help_format)
    cli.add_argument("--config", type=Path, default=Path("field-hard"), help="file or name in training/configs")
    cli.add_argument("--write", type=Path, help="a page whose last section, 'What many cores would give', is replaced")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), write, arguments)


def write(args: argparse.Namespace) -> int:
    """Prints the section, and puts it in its page."""
    section = page(measure(configs.load(args.config)), args.config.stem)
    print(section)
    if args.write is not None:
        kept = args.write.read_text().split("## What many cores would give")[0]
        args.write.write_text(kept + section)
    return 0


if __name__ == "__main__":
    sys.exit(main())
