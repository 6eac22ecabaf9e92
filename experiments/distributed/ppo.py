"""The lean PPO with its robots on a Ray cluster: one actor a share of the robots, one pool of threads an actor.

    python -m experiments.distributed.ppo --workers 4 --config field-hard --out runs/field
    python -m experiments.distributed.ppo --address auto --workers 64 --num-envs 16384 --out runs/large

Everything but collecting is ``training/learners/ppo.py``: the learner sends its weights out, each actor steps its
robots for a rollout, the learner learns from all of them. The robots of a run draw the same fields however many
actors share them. A budget of steps repeats itself bit for bit for a given number of actors.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial

from experiments.distributed import cluster
from training import run_command
from training.learners import ppo
from training.runs import RunFolder


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = run_command.parser("experiments.distributed.ppo", __doc__)
    cli.add_argument("--workers", type=int, default=2, help="actors, each with an equal share of the robots")
    cli.add_argument("--worker-threads", type=int, help="threads and CPUs of an actor, over the config's num_threads")
    cluster.add_address(cli)
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget has been used up, 130 when it was stopped, 2 without Ray."""
    args = parser().parse_args(arguments)
    if not cluster.installed("ray"):
        return 2
    from experiments.distributed.collector import RayCollector

    args.num_threads = args.worker_threads or args.num_threads
    cluster.join(args.address)
    make = partial(RayCollector, workers=args.workers)
    folder = RunFolder(args.out, ppo.POLICY, ".pt")
    return run_command.run(args, folder, lambda found, config, show: ppo.train(found, config, show, make))


if __name__ == "__main__":
    sys.exit(main())
