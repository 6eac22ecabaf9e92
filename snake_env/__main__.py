"""``python -m snake_env command``: what the package does from the command line."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

COMMANDS = {
    "card": ("snake_env.card", "print or write the environments' reference page"),
    "reproduce": ("snake_env.reproduce.command", "pictures and table of the thesis's findings"),
}
"""Name -> module with ``main(arguments) -> status``, and what it does."""


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; returns its status."""
    listed = "\n".join(f"  {name:<12}{summary}" for name, (_, summary) in COMMANDS.items())
    cli = argparse.ArgumentParser(
        "python -m snake_env",
        description=f"commands:\n{listed}\n\n`python -m snake_env <command> --help` explains each.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    cli.add_argument("command", choices=COMMANDS)
    cli.add_argument("arguments", nargs=argparse.REMAINDER, help="of the command")
    args = cli.parse_args(arguments)
    return import_module(COMMANDS[args.command][0]).main(args.arguments)


if __name__ == "__main__":
    sys.exit(main())
