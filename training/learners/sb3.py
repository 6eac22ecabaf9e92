"""Train a policy with Stable-Baselines3's PPO over the native batch of robots.

    python -m training.train --out runs/mine --config default --max-minutes 10

The run's folder (see ``training/runs.py``) holds everything needed to go on: ``--resume`` continues from
its latest checkpoint with the configuration it was begun with. Ctrl-C saves and stops.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import configure

import snake_env.sb3
from training import run_command, seeds
from training.budget import Budget, StopRequest
from training.config import Config
from training.learners.callbacks import Keeper
from training.runs import RunFolder

LACKS = ("clone", "policy.mirror", "policy.traces", "policy.bfloat16")
"""What ``training.learners.ppo`` has and this learner has not."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    return run_command.parser("training.learners.sb3", __doc__)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget has been used up, 130 when it was stopped."""
    args = parser().parse_args(arguments)
    return run_command.run(args, RunFolder(args.out), train)


def train(folder: RunFolder, config: Config, bar: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start."""
    checkpoint = folder.latest()
    if checkpoint is None:
        config.refuse_evolution("training.learners.sb3")
    config.refuse("training.learners.sb3", *LACKS)
    torch.set_num_threads(config.torch_threads)
    seconds = 0.0 if checkpoint is None else folder.seconds(checkpoint)
    budget = Budget(config.total_steps, config.max_minutes, seconds)
    steps_taken = 0 if checkpoint is None else int(checkpoint.stem)
    env = snake_env.sb3.make(config.env_id, config.num_envs, num_threads=config.num_threads, **config.env)
    env.seed(seeds.training(config.seed, steps_taken, config.num_envs))
    if checkpoint is None:
        model = _new_model(config, env, budget)
    else:
        with folder.resumed():
            model = _resumed_model(checkpoint, config, env, budget)
    model.set_logger(configure(str(folder.path / "tensorboard"), ["tensorboard"]))
    with StopRequest() as stop:
        keeper = Keeper(folder, config, budget, stop, bar)
        model.learn(config.total_steps - steps_taken, keeper, reset_num_timesteps=checkpoint is None)
        keeper.save()
        keeper.close()
        if stop.received:
            print(f"saved after {model.num_timesteps} steps")
            return 130
    model.save(folder.model)
    folder.finish({"steps": model.num_timesteps, "seconds": round(budget.seconds, 1)})
    env.close()
    return 0


def _new_model(config: Config, env: Any, budget: Budget) -> PPO:
    return PPO(
        "MlpPolicy",
        env,
        seed=config.seed,
        device="cpu",
        policy_kwargs={"net_arch": list(config.policy.hidden), "log_std_init": config.policy.log_std},
        **_learner(config, budget),
    )


def _resumed_model(checkpoint: Path, config: Config, env: Any, budget: Budget) -> PPO:
    model = PPO.load(checkpoint, env, device="cpu", **_learner(config, budget))
    model.set_random_seed(config.seed + model.num_timesteps)
    return model


def _learner(config: Config, budget: Budget) -> dict[str, Any]:
    """Keywords of the learner; the learning rate falls with the share of the budget that is used."""
    values = dataclasses.asdict(config.ppo)
    start, end = values.pop("learning_rate"), values.pop("final_learning_rate")
    return {**values, "learning_rate": lambda _: start * (1.0 - (1.0 - end) * budget.used)}


if __name__ == "__main__":
    sys.exit(main())
