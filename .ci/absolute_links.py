"""Writes the repository's address, which only its host knows, into the metadata of a release.

    python .ci/absolute_links.py https://host/owner/name v0.2.0

Package indexes show the README without the repository around it: pictures and links that are relative become absolute.
``pyproject.toml`` gets the project's URLs. Both files are changed in place, in a checkout that is thrown away.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
TARGET = re.compile(r"(!\[[^\]]*\]|\])\((?![a-z]+:|#)([^)]+)\)")
"""What follows the words of a picture or of a link; a picture can be the words of a link."""


def absolute(markdown: str, address: str, version: str) -> str:
    """The text with relative pictures and links made absolute."""
    return TARGET.sub(lambda m: f"{m[1]}({address}/{'blob' if m[1] == ']' else 'raw'}/{version}/{m[2]})", markdown)


def urls(address: str, version: str) -> str:
    """The section of the project's URLs."""
    pages = {"Repository": "", "Issues": "/issues", "Changelog": f"/blob/{version}/CHANGELOG.md"}
    return "\n[project.urls]\n" + "".join(f'{name} = "{address}{page}"\n' for name, page in pages.items())


def main(address: str, version: str) -> None:
    """Changes both files."""
    readme, project = ROOT / "README.md", ROOT / "pyproject.toml"
    readme.write_text(absolute(readme.read_text(encoding="utf-8"), address, version), encoding="utf-8")
    project.write_text(project.read_text(encoding="utf-8") + urls(address, version), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
