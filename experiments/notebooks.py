"""Pages and tutorials as notebooks, which Colab opens from the repository.

    python -m experiments.notebooks --write      # `make docs`

Text and snippets are those of the pages. The first cell installs the package where it is not there.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import Any

from snake_env._files import write_text

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "notebooks"
SOURCES = ("simulate.md", "training.md", "tutorials/spatial.py")
EXTRAS = "evaluate,render,reproduce,sb3"
INSTALL = f"""\
# Installs the package where it is missing: from the package index, or from a repository, which takes some minutes.
REPOSITORY = ""  # such as "https://github.com/OWNER/NAME"
try:
    import snake_env
except ModuleNotFoundError:
    import subprocess
    import sys

    name = "snake-robot-env[{EXTRAS}]" + (f" @ git+{{REPOSITORY}}" if REPOSITORY else "")
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", name], check=True)"""
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((?![a-z]+://)[^)]*\)")
"""A link to a page, which a notebook does not have beside it."""

Cells = list[tuple[str, str]]
"""Kind, "markdown" or "code", and text."""


def of_page(text: str) -> Cells:
    """Snippets of a page as code, the rest as text."""
    parts = re.split(r"^```python\n(.*?)^```\n", text, flags=re.MULTILINE | re.DOTALL)
    return [("code" if k % 2 else "markdown", part) for k, part in enumerate(parts)]


def of_script(text: str) -> Cells:
    """Cells of a script in the percent format."""
    found = re.findall(r"^# %%( \[markdown\])?\n(.*?)(?=^# %%|\Z)", text, re.MULTILINE | re.DOTALL)
    return [("markdown", re.sub(r"^# ?", "", body, flags=re.M)) if kind else ("code", body) for kind, body in found]


def notebook(source: str) -> str:
    """The notebook of a page or of a tutorial, as its file has it."""
    text = (DOCS / source).read_text(encoding="utf-8")
    parts = of_script(text) if source.endswith(".py") else of_page(text)
    cells: list[dict[str, Any]] = []
    for k, (kind, body) in enumerate([("code", INSTALL), *parts]):
        if not body.strip():
            continue
        body = LINK.sub(r"\1", body) if kind == "markdown" else body
        own: dict[str, Any] = {"execution_count": None, "outputs": []} if kind == "code" else {}
        lines = body.strip("\n").splitlines(keepends=True)
        cells.append({"cell_type": kind, "id": f"cell-{k}", "metadata": {}, "source": lines, **own})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    made = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(made, ensure_ascii=False, indent=1) + "\n"


def notebooks() -> dict[str, str]:
    """All notebooks by the names of their files."""
    return {f"{Path(source).stem}.ipynb": notebook(source) for source in SOURCES}


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 1 if a notebook was not up to date."""
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--write", action="store_true", help="write them, instead of telling which are not up to date")
    args = cli.parse_args(arguments)
    stale = 0
    for name, text in notebooks().items():
        path = FOLDER / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale += 1
            print(f"{'wrote' if args.write else 'not up to date:'} {path.relative_to(DOCS.parent)}")
            if args.write:
                path.parent.mkdir(exist_ok=True)
                write_text(path, text)
    return 0 if args.write else min(stale, 1)


if __name__ == "__main__":
    sys.exit(main())
