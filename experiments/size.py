"""The size of the repository: files and lines by folder, words of the documentation.

    python -m experiments.size

    python -m experiments.size ../earlier    # another checkout

Tracked files only. Lines are those of ``wc -l``, words those of ``wc -w``. Code is what is neither blank nor comment,
docstring or test.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
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


def code_lines(path: PurePath, text: str) -> int:
    """Lines of a Rust or Python file that hold code which is no test."""
    if "tests" in path.parts:
        return 0
    if path.suffix == ".rs":
        text = re.split(r"^#\[cfg\(test\)\]\n(?:pub )?mod tests \{$", text, maxsplit=1, flags=re.MULTILINE)[0]
        return sum(not line.lstrip().startswith("//") for line in text.splitlines() if line.strip())
    found: set[int] = set()
    last = tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in _LAYOUT:
            continue
        is_docstring = token.type == tokenize.STRING and last == tokenize.NEWLINE
        if token.type != tokenize.NEWLINE and not is_docstring:
            found.update(range(token.start[0], token.end[0] + 1))
        last = token.type
    return len(found)


_LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def sizes(root: Path = ROOT) -> tuple[list[tuple[str, str, int, int, int]], dict[str, int]]:
    """Rows (language, folder, files, lines, lines of code), and the words of each document.

    Args:
        root: of a git checkout.
    """
    tracked = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout
    files: Counter[tuple[str, str]] = Counter()
    lines: Counter[tuple[str, str]] = Counter()
    code: Counter[tuple[str, str]] = Counter()
    words = {}
    for name in filter(lambda name: (root / name).is_file(), tracked.splitlines()):
        path, language = PurePath(name), {".rs": "Rust", ".py": "Python"}.get(PurePath(name).suffix)
        if language:
            row = (language, folder_of(path))
            files[row] += 1
            text = (root / name).read_text()
            lines[row] += text.count("\n")
            code[row] += code_lines(path, text)
        elif path.suffix == ".md":
            words[name] = len((root / name).read_text().split())
    return [(*row, files[row], lines[row], code[row]) for row in sorted(files)], words


def main() -> None:
    """Prints three tables, and the size as a whole."""
    rows, words = sizes(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
    for language in ("Rust", "Python"):
        mine = [row[1:] for row in rows if row[0] == language]
        total = ("**total**", sum(row[1] for row in mine), sum(row[2] for row in mine), sum(row[3] for row in mine))
        cells = [(*row[:2], f"{row[2]:,}", f"{row[3]:,}") for row in [*mine, total]]
        print(table((language, "files", "lines", "code"), cells), end="\n\n")
    documents = [*sorted(words.items()), ("**total**", sum(words.values()))]
    print(table(("document", "words"), [(name, f"{count:,}") for name, count in documents]), end="\n\n")
    for name, folder in (("core", "rust/core/src"), ("thesis", "rust/thesis/src"), ("repository without docs", "")):
        chosen = [row for row in rows if row[1].startswith(folder) and not row[1].startswith("docs")]
        print(f"{name}: {sum(row[3] for row in chosen):,} lines, {sum(row[4] for row in chosen):,} of code")


if __name__ == "__main__":
    main()
