"""``snake-env command``, or ``python -m snake_env command``: what the package does from the command line."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

import gymnasium as gym

from snake_env import __version__
from snake_env.errors import ConfigError

COMMANDS = {
    "view": ("snake_env.commands.view:main", "watch and steer a robot in the browser"),
    "play": ("snake_env.commands.play:main", "watch an episode in a window"),
    "film": ("snake_env.commands.play:film", "film an episode"),
    "train": ("snake_env.commands.train:main", "train a policy with PPO of Stable-Baselines3"),
    "evaluate": ("snake_env.commands.evaluate:main", "score policies on test scenes"),
    "export": ("snake_env.commands.export:main", "write a policy as an ONNX file"),
    "card": ("snake_env.commands.card:main", "the card of a policy, or the environments' reference page"),
    "bench": ("snake_env.commands.bench:main", "environment steps per second on this machine"),
    "reproduce": ("snake_env.reproduce.command:main", "pictures and table of the thesis's findings"),
}
"""Name -> function of the arguments that returns the status, and what it does."""

PAGE = """snake-env {version}: snake robots that push against obstacles

{commands}

`snake-env <command> --help` explains each. To begin with:

  snake-env view --policy general        a trained robot in the browser
  snake-env train --out mine.zip         train one of your own,
  snake-env view --policy mine.zip       and watch it
"""


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; returns its status: 2 after one line about what is wrong with its input, 130 when interrupted."""
    listed = "\n".join(f"  {name:<12}{summary}" for name, (_, summary) in COMMANDS.items())
    page = PAGE.format(version=__version__, commands=listed)
    cli = argparse.ArgumentParser(
        "snake-env",
        usage="snake-env [--version] <command> [arguments]",
        description=page,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    cli.add_argument("--version", action="version", version=f"snake-env {__version__}")
    cli.add_argument("command", choices=COMMANDS, nargs="?", help=argparse.SUPPRESS)
    cli.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    args = cli.parse_args(arguments)
    if args.command is None:
        print(page, end="")
        return 0
    module, _, function = COMMANDS[args.command][0].partition(":")
    try:
        status: int = getattr(import_module(module), function)(args.arguments)
    except (ConfigError, gym.error.Error) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\nstopped", file=sys.stderr)
        return 130
    return status


if __name__ == "__main__":
    sys.exit(main())
