"""The table of findings as text, Markdown and JSON."""

from __future__ import annotations

import dataclasses
import json
import textwrap
from pathlib import Path

from snake_env._markdown import table
from snake_env.reproduce.findings import Finding

HEADER = ("", "section", "finding", "thesis", "here")
WIDTHS = (4, 7, 38, 40, 44)


def printed(findings: list[Finding]) -> str:
    """A table for a terminal."""
    lines = [_line(HEADER), _line(tuple("-" * width for width in WIDTHS))]
    for finding in findings:
        cells = [textwrap.wrap(cell, width) or [""] for cell, width in zip(_cells(finding), WIDTHS, strict=True)]
        height = max(len(cell) for cell in cells)
        padded = [cell + [""] * (height - len(cell)) for cell in cells]
        lines += [_line(row) for row in zip(*padded, strict=True)]
    return "\n".join(lines)


def markdown(findings: list[Finding]) -> str:
    """A Markdown page."""
    rows = ([cell.replace("|", "\\|") for cell in _cells(finding)] for finding in findings)
    return f"# Findings of the thesis\n\n{summary(findings)}\n\n{table(HEADER, rows)}\n"


def summary(findings: list[Finding]) -> str:
    """How many findings were reproduced."""
    return f"{sum(finding.passed for finding in findings)} of {len(findings)} findings reproduced."


def write(findings: list[Finding], folder: Path) -> None:
    """Writes ``findings.md`` and ``findings.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "findings.md").write_text(markdown(findings))
    rows = [dataclasses.asdict(finding) for finding in findings]
    (folder / "findings.json").write_text(json.dumps(rows, indent=2) + "\n")


def _cells(finding: Finding) -> tuple[str, ...]:
    return ("pass" if finding.passed else "FAIL", finding.section, finding.name, finding.thesis, finding.ours)


def _line(cells: tuple[str, ...]) -> str:
    return "  ".join(cell.ljust(width) for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()
