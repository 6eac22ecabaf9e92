"""The names of docs/notation.md are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/notation.md"


def tables() -> list[list[list[str]]]:
    """Rows of cells of each table, the head first."""
    blocks = re.findall(r"(?:^\|.*\|\n)+", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    rows = [[line.strip("|\n").split(" | ") for line in block.splitlines()] for block in blocks]
    return [[[cell.strip() for cell in row] for row in table if set("".join(row)) - set("-| ")] for table in rows]


def test_every_code_name_occurs_in_the_code():
    files = [
        file
        for folder in ("rust", "snake_env")
        for suffix in ("rs", "py")
        for file in (ROOT / folder).rglob(f"*.{suffix}")
    ]
    words = set(re.findall(r"\w+", "\n".join(file.read_text(encoding="utf-8") for file in files)))
    names = []
    for head, *rows in tables():
        if "code name" in head:
            column = head.index("code name")
            names += [name for row in rows for name in re.findall(r"`(\w+)`", row[column])]
    assert len(names) > 80
    assert sorted(set(names) - words) == []


def test_a_word_is_defined_once():
    glossary = next(rows for head, *rows in tables() if head[0] == "term")
    terms = [term for row in glossary for term in row[0].split(", ")]
    assert len(terms) == len(set(terms)) > 30
    assert terms == sorted(terms, key=str.casefold)
