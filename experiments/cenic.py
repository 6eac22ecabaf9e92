"""What the error control of CENIC (arXiv 2511.08771) would choose for our implicit Euler steps, and what that costs.

    python -m experiments.cenic
    python -m experiments.cenic --quick

Builds and runs the part ``cenic`` of ``snake-bench``, whose source says what is controlled and how; columns as in
``experiments.random_action_errors``. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np

from benchmarks import native
from experiments import random_action_errors
from experiments.random_action_errors import Run
from snake_env.markdown import table

HEAD = (
    "scene",
    "stepping",
    "length of a step, 5 %, median, 95 % [ms]",
    "rejected [%]",
    "linear solves per period",
    *random_action_errors.HEAD[5:],
)


def run_of(record: dict[str, Any]) -> Run:
    """The run of a batch; no episode ends in it."""
    work = np.array(record["work"])
    position = np.array(record["position"]).swapaxes(0, 1)
    return Run(position, work, np.zeros(len(work), dtype=bool), record["solves"], 0.0)


def row(record: dict[str, Any], reference: Run) -> tuple[str, ...]:
    """A row of the table."""
    lengths, rejected = record["lengths"], record["rejected"]
    chosen = ("", "")
    if lengths:
        quantiles = 1e3 * np.quantile(lengths, [0.05, 0.5, 0.95])
        chosen = (", ".join(f"{each:.1f}" for each in quantiles), f"{100 * rejected / (rejected + len(lengths)):.0f}")
    _, _, name, solves, _, *errors = random_action_errors.row("", "", record["stepping"], run_of(record), reference)
    return (record["scene"], name, *chosen, solves, *errors)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few robots, for a short time")
    options = ["--quick"] if parser.parse_args(arguments).quick else []
    references, rows = {}, []
    for record in native.measure(native.build(), ["cenic", *options], lambda line: print(line, file=sys.stderr)):
        if record["stepping"] == "reference":
            references[record["scene"]] = run_of(record)
        else:
            rows.append(row(record, references[record["scene"]]))
    print(table(HEAD, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
