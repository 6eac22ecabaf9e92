"""Train a policy: start a run in a folder, or resume the run in it.

    python -m training train --config field-hard --seed 0 --out runs/field
    python -m training train --config field-hard --learner sb3 --ppo.learning-rate 3e-4 --out runs/sb3
    python -m training train --resume --out runs/field

Learners are ppo (the PPO of this package), sb3 (the PPO of Stable-Baselines3) and evolution (CMA-ES).
Every value of a configuration has an option; the options depend on the learner. Ctrl-C saves and stops. The budget is
in environment steps: the same configuration and seed give the same policy, whatever the speed of the machine and
however often the run was stopped. ``tensorboard --logdir runs/field`` shows losses, diagnostics and evaluations.
"""

from __future__ import annotations

import dataclasses
import os
import signal
import sys
import threading
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

import gymnasium as gym
import tyro

from snake_env import ConfigError
from training import config as configs
from training import config_file
from training.cli import as_typed
from training.config import LearnerName, RunConfig
from training.runs import RunFolder, StaleRun, sole_writer

ENDS_WITH_INPUT = "TRAINING_ENDS_WITH_INPUT"
"""Environment variable of processes that another one has started, which holds the other end of their standard input."""

MODULES = {
    "sb3": "training.learners.sb3",
    "ppo": "training.learners.ppo",
    "evolution": "training.learners.evolution",
}
"""By ``learner``; ``train`` of each trains the run of a folder from its latest checkpoint on, and can show progress."""


@dataclass
class Options:
    """The run.

    Args:
        out: Folder of the run.
        config: YAML or JSON file, or a name in training/configs.
        resume: Continue from the latest checkpoint if the folder holds a run.
        action_mode: Meaning of the actions; overrides the configuration.
        bar: Show progress.
        learner: Overrides the configuration.
    """

    out: Path = Path("runs/train")
    config: Path = Path("default")
    resume: bool = False
    action_mode: Literal["gait", "joints", "residual"] | None = None
    bar: bool = True
    learner: LearnerName | None = None


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget is used up, 130 when it was stopped, 2 when the run cannot begin."""
    if os.environ.get(ENDS_WITH_INPUT):
        _end_with_input()
    try:
        return _run(*_parse(sys.argv[1:] if arguments is None else arguments))
    except (StaleRun, ConfigError, gym.error.Error) as error:
        print(error, file=sys.stderr)
        return 2


def _end_with_input() -> None:
    """Makes the process save and stop when its standard input ends: with the process at the other end of it."""

    def wait() -> None:
        while os.read(sys.stdin.fileno(), 4096):  # without the lock of a buffer, which would outlast the interpreter
            pass
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=wait, daemon=True).start()


def _parse(given: list[str]) -> tuple[Options, RunConfig]:
    """Options and configuration; the configuration that the options name has the defaults of its own options.

    Raises:
        ConfigError: an option, the configuration, or what overrides it, is not admissible.
        StaleRun: the run in the folder does not fit this version.
    """
    without_help, prog = [one for one in given if one not in ("-h", "--help")], as_typed()
    options, _ = tyro.cli(Options, prog=prog, args=without_help, return_unknown_args=True)
    configs.check(options)
    folder = RunFolder(options.out)
    begun = folder.config() if options.resume and folder.exists else None
    default = begun or configs.load(options.config, options.learner)
    both = dataclasses.make_dataclass(
        "Both",
        [
            ("options", Annotated[Options, tyro.conf.arg(name="")]),
            ("values", Annotated[type(default), tyro.conf.arg(name="")], default),
        ],
    )
    with configs.checked(type(default)):
        parsed: Any = tyro.cli(both, prog=prog, args=given, description=__doc__, config=(tyro.conf.AvoidSubcommands,))
    config: RunConfig = parsed.values.with_changes(env=config_file.merged(default.env, parsed.values.env))
    if options.action_mode is not None:
        config = config.with_changes(env=config.env | {"action_mode": options.action_mode})
    if begun is not None:
        _require_same_run(begun, config)
        folder.require_budget(config.total_steps)
    return options, config


def _require_same_run(begun: RunConfig, config: RunConfig) -> None:
    """Raises unless only budget, threads and checkpoints of a resumed run are new."""
    for name in type(begun).model_fields:
        before, now = getattr(begun, name), getattr(config, name)
        if now != before and name not in RunConfig.ADJUSTABLE:
            raise ConfigError(name, now, f"{before}, with which the run was begun")


def _run(options: Options, config: RunConfig) -> int:
    with sole_writer(options.out):
        folder = RunFolder(options.out)
        if folder.is_taken and not options.resume:
            print(f"{options.out} already holds a run: choose another --out, or add --resume", file=sys.stderr)
            return 2
        if options.resume and not folder.exists:
            print(f"{options.out} holds no run: starting one", flush=True)
        folder.create(config)
        try:
            status: int = import_module(MODULES[config.learner]).train(folder, config, options.bar)
        except Exception:
            if not folder.has_begun:
                folder.discard()
            raise
    if status == 130:
        print(f"continue with --resume --out {options.out}")
    return status


if __name__ == "__main__":
    sys.exit(main())
