"""Train a policy with Stable-Baselines3's PPO over the native batch of robots.

    python -m training.train --out runs/mine --config default --max-minutes 10

The run's folder (see ``training/run_folder.py``) holds everything needed to go on: ``--resume`` continues from
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
from training import config as configs
from training import seeds
from training.callbacks import Budget, Keeper, StopRequest
from training.cli import help_format
from training.config import Config
from training.run_folder import RunFolder


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.train", description=__doc__, formatter_class=help_format)
    cli.add_argument("--out", type=Path, default=Path("runs/train"), help="folder of the run")
    cli.add_argument("--config", type=Path, default=Path("default"), help="YAML file, or a name in training/configs")
    cli.add_argument("--resume", action="store_true", help="go on from the folder's latest checkpoint")
    cli.add_argument("--max-minutes", type=float, help="wall time after which training ends, over the config's")
    cli.add_argument("--total-steps", type=int, help="environment steps after which training ends, over the config's")
    cli.add_argument("--num-envs", type=int, help="robots in the batch, over the config's")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator, over the config's")
    cli.add_argument("--torch-threads", type=int, help="threads of the learner, over the config's")
    cli.add_argument("--seed", type=int, help="seed of networks, noise and fields, over the config's")
    cli.add_argument("--action-mode", choices=["gait", "joints", "residual"], help="meaning of actions")
    cli.add_argument("--no-bar", action="store_true", help="no progress bar")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget has been used up, 130 when it was stopped."""
    args = parser().parse_args(arguments)
    folder = RunFolder(args.out)
    if args.resume and folder.exists:
        config = _overridden(folder.config(), args, ("max_minutes", "total_steps", "num_threads", "torch_threads"))
    else:
        if folder.exists:
            print(f"{args.out} holds a run: choose another --out, or --resume", file=sys.stderr)
            return 2
        config = _overridden(configs.load(args.config), args, OVERRIDES)
    folder.create(config)
    return train(folder, config, bar=not args.no_bar)


OVERRIDES = ("max_minutes", "total_steps", "num_envs", "num_threads", "torch_threads", "seed")


def _overridden(config: Config, args: argparse.Namespace, names: tuple[str, ...]) -> Config:
    """The configuration with what the command line gave."""
    changes = {name: getattr(args, name) for name in names if getattr(args, name) is not None}
    if args.action_mode is not None and not args.resume:
        changes["env"] = {**config.env, "action_mode": args.action_mode}
    return dataclasses.replace(config, **changes)


def train(folder: RunFolder, config: Config, bar: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start."""
    torch.set_num_threads(config.torch_threads)
    checkpoint = folder.latest()
    budget = Budget(config, 0.0 if checkpoint is None else folder.seconds(checkpoint))
    steps_taken = 0 if checkpoint is None else int(checkpoint.stem)
    env = snake_env.sb3.make(config.env_id, config.num_envs, num_threads=config.num_threads, **config.env)
    env.seed(seeds.training(config.seed, steps_taken, config.num_envs))
    model = _new_model(config, env, budget) if checkpoint is None else _resumed_model(checkpoint, config, env, budget)
    model.set_logger(configure(str(folder.path / "tensorboard"), ["tensorboard"]))
    with StopRequest() as stop:
        keeper = Keeper(folder, config, budget, stop, bar)
        model.learn(config.total_steps - steps_taken, keeper, reset_num_timesteps=checkpoint is None)
        keeper.save()
        keeper.close()
        if stop.received:
            print(f"saved after {model.num_timesteps} steps; go on with --resume --out {folder.path}")
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
