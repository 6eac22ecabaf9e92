"""The tables of docs/protocol.md that follow from data: classes of robot and tracks.

python -m experiments.protocol_tables            # print
python -m experiments.protocol_tables --write    # into docs/protocol.md
"""

from __future__ import annotations

import argparse
import sys

from snake_env import robot_classes
from snake_env._files import write_text
from snake_env.evaluation import tracks
from snake_env.markdown import table
from training.config import ROOT

PAGE = ROOT / "docs/protocol.md"


def classes() -> str:
    """What each class of robot has, and from where."""
    rows = [
        (f"`{name}`" if part is one["parts"][0] else "", part["what"], part["source"])
        for name, one in robot_classes.load().items()
        for part in one["parts"]
    ]
    return table(("class", "has", "source"), rows)


def of_tracks() -> str:
    """What each track admits."""
    rows = [
        (f"`{name}`", one["senses"], ", ".join(f"`{block}`" for block in one["blocks"]))
        for name, one in tracks.load().items()
    ]
    return table(("track", "senses", "blocks of the observation"), rows)


TABLES = {"classes": classes, "tracks": of_tracks}
"""By the name in the comment before each table."""


def written(page: str) -> str:
    """The page with its tables as the data are now."""
    for name, make in TABLES.items():
        begin, end = f"<!-- {name}: python -m experiments.protocol_tables --write -->", "<!-- end -->"
        before, found, after = page.partition(begin)
        if not found:
            raise ValueError(f"{PAGE}: expected {begin}")
        page = f"{before}{begin}\n\n{make()}\n\n{end}{after.partition(end)[2]}"
    return page


def main(arguments: list[str] | None = None) -> int:
    """Prints or writes the tables."""
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--write", action="store_true", help="write them into docs/protocol.md")
    if cli.parse_args(arguments).write:
        write_text(PAGE, written(PAGE.read_text()))
    else:
        print("\n\n".join(make() for make in TABLES.values()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
