"""The card of a shipped policy, or the environments' reference page.

snake-env card field-hard
snake-env card --write docs/environments.md
"""

from __future__ import annotations

import argparse
from pathlib import Path

from snake_env import card
from snake_env.policies.shipped import NAMES, load_policy


def main(arguments: list[str]) -> int:
    """Prints the card or the page, or writes the page to a file."""
    cli = argparse.ArgumentParser(
        "snake-env card", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    cli.add_argument("policy", nargs="?", help=f"{', '.join(NAMES)}, or the file of one; default: the environments")
    cli.add_argument("--write", type=Path, metavar="FILE", help="write to FILE instead of printing")
    args = cli.parse_args(arguments)
    text = card.page() if args.policy is None else str(load_policy(args.policy).card)
    if args.write is None:
        print(text, end="")
    else:
        args.write.parent.mkdir(parents=True, exist_ok=True)
        args.write.write_text(text, encoding="utf-8")
    return 0
