"""Search hyper-parameters with Ray Tune: trials of Stable-Baselines3, the hopeless ones ended early.

    python -m experiments.distributed.tune --config field-hard --trials 32 --total-steps 1000000 --out runs/search
    python -m experiments.distributed.tune --address auto --trials 512 --config field-hard --out runs/search

A trial is a run of ``training.learners.sb3`` with hyper-parameters drawn from :func:`space`, one CPU each, on
whatever node Ray puts it. Successive halving (Li et al. 2020) compares the success rate plus speed [m/s] of trials
after equal numbers of steps and goes on with the better third. ``best.json`` in the folder is a configuration for
``--config`` of every learner but evolution. Ctrl-C stops; the same command goes on. Needs the dependency group ``ray``.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.distributed import cluster
from training import config as configs
from training.cli import answer
from training.config import Count, Sb3Config
from training.progress import merit
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
    """A run's folder that also reports each line of the learning curve to Tune."""

    def append_curve(self, row: dict[str, Any]) -> None:
        """Adds a line to the learning curve."""
        from ray import tune

        super().append_curve(row)
        tune.report({**row, "score": merit(row)})


def trial(drawn: dict[str, Any], config: Sb3Config) -> None:
    """Trains with the hyper-parameters that were drawn, in the working directory that Tune gives the trial."""
    from ray import tune

    from training.learners import sb3

    folder = Reporting(Path(tune.get_context().get_trial_dir()))
    mine = config.with_changes(ppo=config.ppo.with_changes(**drawn))
    folder.create(mine)
    sb3.train(folder, mine, bar=False)


def search(config: Sb3Config, trials: int, out: Path) -> Sb3Config:
    """Runs or resumes a search in a folder.

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
    return config.with_changes(ppo=config.ppo.with_changes(**best.config))


@dataclass
class Options:
    """What is searched.

    Args:
        config: File or name in training/configs.
        trials: Number of samples of hyper-parameters.
        total_steps: Environment steps of a full trial, over the configuration's.
        address: Of a running cluster, or 'auto'; None: Ray starts on this machine.
        out: Folder of the search.
    """

    config: Path = Path("field-hard")
    trials: Count = 16
    total_steps: Count | None = None
    address: str | None = None
    out: Path = Path("runs/search")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 2 without Ray."""
    return answer(Options, run, __doc__, arguments)


def run(args: Options) -> int:
    """Searches, and writes the best configuration."""
    cluster.require("ray")
    steps = {} if args.total_steps is None else {"total_steps": args.total_steps}
    config = configs.load_as(Sb3Config, args.config).with_changes(num_threads=1, torch_threads=1, **steps)
    cluster.join(args.address)
    best = search(config, args.trials, args.out.resolve())
    configs.save(best, args.out / "best.json")
    print(f"best hyper-parameters: {best.ppo}")
    print(f"{args.out / 'best.json'}: a configuration of the learners sb3 and ppo")
    return 0


if __name__ == "__main__":
    sys.exit(main())
