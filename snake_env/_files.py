"""Files that are written whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any


def replace(path: str | os.PathLike[str], write: Callable[[Path], object]) -> None:
    """Writes a file beside ``path`` and puts it in its place in one operation, once it is on the disk.

    What is no regular file, such as a pipe, is written directly.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        write(target)
        return
    part = target.with_name(f"part-{os.getpid()}-{target.name}")
    try:
        write(part)
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes a text file."""
    replace(path, lambda part: part.write_text(text, encoding="utf-8"))


def write_json(path: str | os.PathLike[str], content: Any) -> None:
    """Writes a JSON file, indented."""
    write_text(path, json.dumps(content, indent=2) + "\n")
