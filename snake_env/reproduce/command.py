"""Reproduce the findings of the thesis: figures and one table.

Sections 2.3.2 (other models), 2.4.1 (slopes), 2.4.2 (gaits), 5.3 (Fig. 5.2), 6.3.3 (Theorem 6.1), 7.3.1 (Fig. 7.2 and
7.3), 7.3.2 (Fig. 7.4), 7.3.3 (Fig. 7.5), 7.3.4 (Fig. 7.6 to 7.9), 7.3.5 (Fig. 7.10 and 7.11), 7.5.1 (Fig. 7.12 and
7.13), 7.5.2 (Fig. 7.14), 7.5.3 (Fig. 7.15 and 7.16), 7.6 and 8 (broken joints). Writes PNG files, findings.md and
findings.json. Each row is a statement of the thesis that is reproduced, one that is refuted or refined, or a finding of
our own; the exit status is 1 if a row is not within its bound.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from snake_env._cli import parser
from snake_env._extras import extras
from snake_env.reproduce import report
from snake_env.reproduce.checks import CHECKS
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.experiments import experiments
from snake_env.reproduce.findings import SECTIONS, Finding


def findings(runs: Runs, sections: tuple[str, ...] = SECTIONS) -> list[Finding]:
    """The table's rows of some sections."""
    return [check.finding(runs) for check in CHECKS if check.section in sections]


def main(arguments: list[str]) -> int:
    """Runs the experiments, writes and prints; 0 if every row holds."""
    cli = parser("reproduce", __doc__)
    cli.add_argument("--out", type=Path, default=Path("runs/reproduce"), help="folder for figures and table")
    cli.add_argument(
        "--section",
        nargs="+",
        choices=SECTIONS,
        metavar="SECTION",
        default=list(SECTIONS),
        help="sections of the thesis; default all",
    )
    cli.add_argument(
        "--method",
        choices=["implicit", "thesis"],
        default="implicit",
        help="time stepping: the environments' (default), or Algorithms 3.1 and 4.1 as printed, with the parameters "
        "that each section prescribes",
    )
    cli.add_argument("--quick", action="store_true", help="only the table, no figures")
    return _reproduce(cli.parse_args(arguments))


def _reproduce(args: argparse.Namespace) -> int:
    if not args.quick:
        with extras():  # the table does without
            from snake_env.reproduce import figures
    runs = Runs(experiments(), args.method)
    sections = tuple(args.section)
    table = findings(runs, sections)
    report.write(table, args.out)
    if not args.quick:
        for path in figures.write(runs, args.out, sections):
            print(path)
    print(report.printed(table))
    print(f"\n{report.summary(table)} Written to {args.out}.")
    return 0 if all(finding.holds for finding in table) else 1
