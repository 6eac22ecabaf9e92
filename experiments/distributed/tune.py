"""Search hyper-parameters with Ray Tune: trials of Stable-Baselines3, the hopeless ones ended early.

    python -m experiments.distributed.tune --config field-hard --trials 32 --total-steps 1000000 --out runs/search
    python -m experiments.distributed.tune --address auto --trials 512 --config field-hard --out runs/search

A trial is a run of ``training.learners.sb3`` with hyper-parameters drawn from :func:`space`, one CPU each, on
whatever node Ray puts it. Successive halving (Li et al. 2020) compares the success rate plus speed [m/s] of trials
after equal numbers of steps and goes on with the better third. ``best.json`` in the folder is a configuration for
``--config`` of every learner but evolution. Ctrl-C stops; the same command goes on. Needs the extra ``ray``.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

from experiments.distributed import cluster
from training import config as configs
from training.cli import answer, help_format
from training.config import Config
from training.runs import RunFolder

FIRST_LOOK = 0.1
"""Share of the steps after which trials are first compared."""


def space() -> dict[str, Any]:
    """Where hyper-parameters of :class:`training.config.Ppo` are drawn from."""
    from ray import tune

    return {
        "learning_rate": tune.loguniform(1e-4, 2e-3),
        "n_steps": tune.choice([64, 128, 256]),
        "batch_size": tune.choice([512, 1024, 2048]),
        "n_epochs": tune.randint(3, 11),
        "gamma": tune.choice([0.97, 0.98, 0.99, 0.995]),
        "gae_lambda": tune.uniform(0.9, 0.98),
        "clip_range": tune.uniform(0.1, 0.3),
    }


class Reporting(RunFolder):
    """A run's folder that also tells Tune each line of the learning curve."""

    def append_curve(self, row: dict[str, Any]) -> None:
        """Adds a line to the learning curve."""
        from ray import tune

        super().append_curve(row)
        tune.report({**row, "score": row.get("is_success", 0.0) + row.get("speed", 0.0)})


def trial(drawn: dict[str, Any], config: Config) -> None:
    """Trains with the hyper-parameters that were drawn, in the working directory that Tune gives the trial."""
    from ray import tune

    from training.learners import sb3

    folder = Reporting(Path(tune.get_context().get_trial_dir()))
    mine = dataclasses.replace(config, ppo=dataclasses.replace(config.ppo, **drawn))
    folder.create(mine)
    sb3.train(folder, mine, bar=False)


def search(config: Config, trials: int, out: Path) -> Config:
    """Runs or goes on with a search in a folder.

    Args:
        config: what the trials share.
        trials: how many hyper-parameters are drawn.
        out: folder of the search.

    Returns:
        The configuration with the best hyper-parameters.
    """
    from ray import tune
    from ray.tune.schedulers import ASHAScheduler

    trainable = tune.with_resources(tune.with_parameters(trial, config=config), {"cpu": config.num_threads})
    if tune.Tuner.can_restore(str(out)):
        tuner = tune.Tuner.restore(str(out), trainable, resume_unfinished=True, restart_errored=True)
    else:
        scheduler = ASHAScheduler(
            time_attr="steps", max_t=config.total_steps, grace_period=int(FIRST_LOOK * config.total_steps)
        )
        tuner = tune.Tuner(
            trainable,
            param_space=space(),
            tune_config=tune.TuneConfig(metric="score", mode="max", num_samples=trials, scheduler=scheduler),
            run_config=tune.RunConfig(name=out.name, storage_path=str(out.parent)),
        )
    best = tuner.fit().get_best_result("score", "max", scope="last-5-avg")
    return dataclasses.replace(config, ppo=dataclasses.replace(config.ppo, **best.config))


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("experiments.distributed.tune", description=__doc__, formatter_class=help_format)
    cli.add_argument("--config", type=Path, default=Path("field-hard"), help="file or name in training/configs")
    cli.add_argument("--trials", type=int, default=16, help="hyper-parameters to draw")
    cli.add_argument("--total-steps", type=int, help="environment steps of a full trial, over the config's")
    cluster.add_address(cli)
    cli.add_argument("--out", type=Path, default=Path("runs/search"), help="folder of the search")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 2 without Ray."""
    return answer(parser(), run, arguments)


def run(args: argparse.Namespace) -> int:
    """Searches, and writes the best configuration."""
    if not cluster.installed("ray"):
        return 2
    config = dataclasses.replace(configs.load(args.config), num_threads=1, torch_threads=1)
    config.refuse_evolution("experiments.distributed.tune")
    if args.total_steps is not None:
        config = dataclasses.replace(config, total_steps=args.total_steps)
    cluster.join(args.address)
    best = search(config, args.trials, args.out.resolve())
    configs.save(best, args.out / "best.json")
    print(f"best hyper-parameters: {best.ppo}")
    print(f"{args.out / 'best.json'}: a configuration for every learner but evolution")
    return 0


if __name__ == "__main__":
    sys.exit(main())
