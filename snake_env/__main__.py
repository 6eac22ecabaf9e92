"""``snake-env command``, or ``python -m snake_env command``: what the package does from the command line."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

import gymnasium as gym

from snake_env.errors import ConfigError

COMMANDS = {
    "play": ("snake_env.commands.play", "watch or film an episode"),
    "view": ("snake_env.commands.view", "watch and steer a robot in the browser"),
    "evaluate": ("snake_env.commands.evaluate", "score policies on test scenes"),
    "reproduce": ("snake_env.reproduce.command", "pictures and table of the thesis's findings"),
    "bench": ("snake_env.commands.bench", "environment steps per second on this machine"),
    "card": ("snake_env.commands.card", "the card of a shipped policy, or the environments' reference page"),
}
"""Name -> module with ``main(arguments) -> status``, and what it does."""


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; returns its status: 2 after one line about what is wrong with its input, 130 when interrupted."""
    listed = "\n".join(f"  {name:<12}{summary}" for name, (_, summary) in COMMANDS.items())
    cli = argparse.ArgumentParser(
        "snake-env",
        description=f"commands:\n{listed}\n\n`snake-env <command> --help` explains each.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    cli.add_argument("command", choices=COMMANDS)
    cli.add_argument("arguments", nargs=argparse.REMAINDER, help="of the command")
    args = cli.parse_args(arguments)
    try:
        status: int = import_module(COMMANDS[args.command][0]).main(args.arguments)
    except (ConfigError, gym.error.Error) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\nstopped", file=sys.stderr)
        return 130
    return status


if __name__ == "__main__":
    sys.exit(main())
