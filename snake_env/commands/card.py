"""The card of a shipped policy, or the environments' reference pages.

snake-env card field-hard
snake-env card --write docs/environments.md
"""

from __future__ import annotations

from pathlib import Path

from snake_env import card
from snake_env._cli import parser
from snake_env._files import write_text
from snake_env.commands import environment_pages
from snake_env.errors import ConfigError
from snake_env.policies.loading import load_policy
from snake_env.policies.shipped import NAMES


def main(arguments: list[str]) -> int:
    """Prints the card or the common page, or writes the pages to files."""
    cli = parser("card", __doc__)
    cli.add_argument("policy", nargs="?", help=f"{', '.join(NAMES)}, or the file of one; default: the environments")
    cli.add_argument(
        "--write", type=Path, metavar="FILE", help="write to FILE instead of printing, pages of the ids to a folder"
    )
    args = cli.parse_args(arguments)
    policy = None if args.policy is None else load_policy(args.policy)
    if policy is not None and not hasattr(policy, "card"):
        raise ConfigError("policy", args.policy, "one that has a card")
    text = card.page() if policy is None else str(policy.card)
    if args.write is None:
        print(text, end="")
        return 0
    _write(args.write, text)
    if args.policy is None:
        for name, page in environment_pages.pages().items():
            _write(args.write.with_suffix("") / name, page)
    return 0


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
