"""PPO with its robots on a Ray cluster: one actor per share of the robots, one pool of threads per actor.

    python -m experiments.distributed.ppo --workers 4 --config field-hard --out runs/field
    python -m experiments.distributed.ppo --address auto --workers 64 --num-envs 16384 --out runs/large

Everything but collecting is ``training/learners/ppo.py``: the learner sends its weights out, each actor steps its
robots for a rollout, the learner learns from all of them. The robots of a run draw the same fields however many actors
share them. A budget of steps repeats itself bit for bit for a given number of actors. --num-threads counts the threads
and CPUs of an actor.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial

from experiments.distributed import cluster
from training.config import Count, PpoConfig, load_as
from training.learners import ppo
from training.runs import RunFolder
from training.train import Options, command


@dataclass
class RayOptions(Options):
    """Which run, and where.

    Args:
        workers: Actors, each with an equal share of the robots.
        address: Of a running cluster, or 'auto'; None: Ray starts on this machine.
    """

    workers: Count = 2
    address: str | None = None


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget is used up, 130 when it was stopped, 2 without Ray."""
    return command(RayOptions, __doc__, arguments, lambda one: load_as(PpoConfig, one.config), train)


def train(options: RayOptions, folder: RunFolder, config: PpoConfig) -> int:
    """Trains on the cluster."""
    cluster.require("ray")
    from experiments.distributed.collector import RayCollector

    cluster.join(options.address)
    return ppo.train(folder, config, options.bar, partial(RayCollector, workers=options.workers))


if __name__ == "__main__":
    sys.exit(main())
