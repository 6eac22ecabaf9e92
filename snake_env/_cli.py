"""Parsers of the commands, and text that fits a terminal."""

from __future__ import annotations

import argparse
import re
import textwrap

WIDTH = 100
"""Columns of what commands print."""


def parser(command: str, text: str | None) -> argparse.ArgumentParser:
    """The parser of a command, whose help begins with ``text``."""
    return argparse.ArgumentParser(
        f"snake-env {command}",
        description=wrapped(text or ""),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def wrapped(text: str, hanging: str = "") -> str:
    """Paragraphs within :data:`WIDTH`; commands, which stand in lines of their own, stay as they are."""
    fill = textwrap.TextWrapper(WIDTH, subsequent_indent=hanging, break_long_words=False, break_on_hyphens=False).fill
    is_command = re.compile(" {4}|snake-env ").match
    return "\n\n".join(part if is_command(part) else fill(part) for part in text.split("\n\n"))
