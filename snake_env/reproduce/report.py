"""The table of findings as text, Markdown and JSON."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Sequence
from pathlib import Path

from snake_env._files import write_json, write_text
from snake_env.markdown import table
from snake_env.reproduce.findings import Finding, Verdict

HEADER = ("verdict", "section", "finding", "the thesis", "here", "bound and reason")
WIDTHS = (10, 7, 17, 18, 17, 21)


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
    """How many findings have which verdict."""
    held = [finding for finding in findings if finding.holds]
    counts = [f"{sum(finding.verdict == verdict for finding in held)} {verdict.value}" for verdict in Verdict]
    failed = len(findings) - len(held)
    return f"{len(findings)} findings: {', '.join(counts)}" + (f", {failed} FAILED." if failed else ".")


def write(findings: list[Finding], folder: Path) -> None:
    """Writes ``findings.md`` and ``findings.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "findings.md", markdown(findings))
    write_json(folder / "findings.json", [dataclasses.asdict(finding) for finding in findings])


def _cells(finding: Finding) -> tuple[str, ...]:
    verdict = finding.verdict.value if finding.holds else "FAIL"
    thesis = finding.thesis or "(no such statement)"
    if finding.independent:
        thesis += f" [independent: {finding.independent}]"
    explained = f"{finding.bound}. {finding.reason}".removesuffix(" ") if finding.reason else finding.bound
    return (verdict, finding.section, finding.name, thesis, finding.ours, explained)


def _line(cells: Sequence[str]) -> str:
    return "  ".join(cell.ljust(width) for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()
