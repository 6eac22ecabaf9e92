"""The command line that the learners share: begins a run in a folder, or goes on with the one in it."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path

import gymnasium as gym

from snake_env import ConfigError
from training import config as configs
from training.cli import help_format
from training.config import Config
from training.runs import RunFolder, StaleRun

Train = Callable[[RunFolder, Config, bool], int]
"""Trains the run of a folder from its latest checkpoint on; the flag asks for a progress display."""

OVERRIDES = ("max_minutes", "total_steps", "num_envs", "num_threads", "torch_threads", "seed")


def parser(prog: str, text: str | None) -> argparse.ArgumentParser:
    """The command line of the learner ``prog``, which explains itself with ``text``."""
    cli = argparse.ArgumentParser(prog, description=text, formatter_class=help_format)
    cli.add_argument("--out", type=Path, default=Path("runs/train"), help="folder of the run")
    cli.add_argument(
        "--config", type=Path, default=Path("default"), help="YAML or JSON file, or a name in training/configs"
    )
    cli.add_argument("--resume", action="store_true", help="go on from the folder's latest checkpoint")
    cli.add_argument("--max-minutes", type=float, help="wall time after which training ends, over the config's")
    cli.add_argument("--seconds", type=float, help="the same in seconds; a resumed run counts what it used before")
    cli.add_argument("--total-steps", type=int, help="environment steps after which training ends, over the config's")
    cli.add_argument("--num-envs", type=int, help="robots in the batch, over the config's")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator, over the config's")
    cli.add_argument("--torch-threads", type=int, help="threads of the learner, over the config's")
    cli.add_argument("--seed", type=int, help="seed of networks, noise and fields, over the config's")
    cli.add_argument("--action-mode", choices=["gait", "joints", "residual"], help="meaning of actions")
    cli.add_argument("--no-bar", action="store_true", help="no progress display")
    return cli


def run(args: argparse.Namespace, folder: RunFolder, train: Train) -> int:
    """Begins or resumes a run; 0 when its budget is used up, 130 when it was stopped, 2 when the folder is taken,
    its run does not fit this version, or the configuration is not admissible.
    """
    if args.seconds is not None:
        args.max_minutes = args.seconds / 60.0
    try:
        status = _run(args, folder, train)
    except (StaleRun, ConfigError, gym.error.Error) as error:
        print(error, file=sys.stderr)
        return 2
    if status == 130:
        print(f"go on with --resume --out {args.out}")
    return status


def _run(args: argparse.Namespace, folder: RunFolder, train: Train) -> int:
    if args.resume and folder.exists:
        with folder.resumed():
            begun = folder.config()
        config = _overridden(begun, args, ("max_minutes", "total_steps", "num_threads", "torch_threads"))
    elif folder.exists:
        print(f"{args.out} holds a run: choose another --out, or --resume", file=sys.stderr)
        return 2
    else:
        if args.resume:
            print(f"{args.out} holds no run yet: begins one", flush=True)
        config = _overridden(configs.load(args.config), args, OVERRIDES)
        if args.action_mode is not None:
            config = dataclasses.replace(config, env={**config.env, "action_mode": args.action_mode})
    new = not folder.exists
    folder.create(config)
    try:
        return train(folder, config, not args.no_bar)
    except Exception:
        if new and not folder.has_begun:
            folder.discard()
        raise


def _overridden(config: Config, args: argparse.Namespace, names: tuple[str, ...]) -> Config:
    """The configuration with what the command line gave."""
    return dataclasses.replace(
        config, **{name: getattr(args, name) for name in names if getattr(args, name) is not None}
    )
