"""The size of the repository: files and lines by folder, words of the documentation.

    python -m experiments.size

Tracked files only. Lines are those of ``wc -l``, words those of ``wc -w``.
"""

from __future__ import annotations

import subprocess
from collections import Counter
from pathlib import Path, PurePath

from snake_env.markdown import table

ROOT = Path(__file__).resolve().parent.parent
DEEP = ("rust", "snake_env", "training", "tests")
"""Folders of which the first folder inside is listed too."""


def folder_of(path: PurePath) -> str:
    """The row that a file is counted in: its folder, two or (in ``rust``) four names deep."""
    depth = 4 if path.parts[0] == "rust" else 2 if path.parts[0] in DEEP else 1
    return "/".join(path.parts[: min(depth, len(path.parts) - 1)])


def sizes(root: Path = ROOT) -> tuple[list[tuple[str, str, int, int]], dict[str, int]]:
    """Rows (language, folder, files, lines), and the words of each document.

    Args:
        root: of a git checkout.
    """
    tracked = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout
    files: Counter[tuple[str, str]] = Counter()
    lines: Counter[tuple[str, str]] = Counter()
    words = {}
    for name in filter(lambda name: (root / name).is_file(), tracked.splitlines()):
        path, language = PurePath(name), {".rs": "Rust", ".py": "Python"}.get(PurePath(name).suffix)
        if language:
            row = (language, folder_of(path))
            files[row] += 1
            lines[row] += (root / name).read_text().count("\n")
        elif path.suffix == ".md":
            words[name] = len((root / name).read_text().split())
    return [(*row, files[row], lines[row]) for row in sorted(files)], words


def main() -> None:
    """Prints three tables."""
    rows, words = sizes()
    for language in ("Rust", "Python"):
        mine = [row[1:] for row in rows if row[0] == language]
        total = ("**total**", sum(row[1] for row in mine), sum(row[2] for row in mine))
        print(table((language, "files", "lines"), [(*r[:2], f"{r[2]:,}") for r in [*mine, total]]), end="\n\n")
    documents = [*sorted(words.items()), ("**total**", sum(words.values()))]
    print(table(("document", "words"), [(name, f"{count:,}") for name, count in documents]))


if __name__ == "__main__":
    main()
