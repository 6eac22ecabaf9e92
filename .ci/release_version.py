"""The version of a release: package, citation, changelog, pages and tag name the same one.

    python .ci/release_version.py v0.2.0    # exit status 1 if one of them does not

Citation and changelog have one date, too.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WHERE = {
    "Cargo.toml": r'^version = "(.*)"$',
    "CITATION.cff": r"^version: (.*)$",
    "CHANGELOG.md": r"^## \[(\d.*)\]",
    "docs/protocol.md": r"^  version = \{(.*)\},$",
}
"""Patterns by file; the first match counts, in the changelog the latest release."""
DATES = {"CITATION.cff": r'^date-released: "(.*)"$', "CHANGELOG.md": r"^## \[\d.*\] - (.*)$"}


def found(patterns: dict[str, str]) -> dict[str, str]:
    """What each file says."""
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in patterns}
    return {file: re.findall(pattern, texts[file], re.MULTILINE)[0] for file, pattern in patterns.items()}


def main(tag: str) -> None:
    """Refuses a tag that does not fit."""
    versions = {**found(WHERE), "the tag": tag.removeprefix("v")}
    if len(set(versions.values())) > 1 or len(set(found(DATES).values())) > 1:
        sys.exit(f"versions and dates of a release must agree: {versions}, {found(DATES)}")


if __name__ == "__main__":
    main(sys.argv[1])
