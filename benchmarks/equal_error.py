"""Cost at equal error under random actions, and environment steps with their errors beside them.

This is a section of the page and, in short, blocks of the pages in :data:`PAGES`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks import curves, texts
from benchmarks.curves import Point
from benchmarks.native import ROOT
from benchmarks.results import Record, Results, place
from snake_env._files import write_text
from snake_env.markdown import table

ERRORS = (0.1, 0.3, 1.0)
"""Median errors of the worst link after one control period at which cost is compared [mm]."""
BEGIN, END = "<!-- python -m benchmarks --parts equal-error --write-docs -->", "<!-- end -->"
OURS, MUJOCO = "ours", "MuJoCo"


class Cost(NamedTuple):
    """CPU time of a simulated second of a robot [s], and the bias of the actuators' positive work."""

    seconds: float
    work_bias: float


def cases(results: Results) -> list[tuple[str, str]]:
    """Environments and modes of action that were measured."""
    return list(dict.fromkeys((r["env"], r["actions"]) for r in results.of("equal_error")))


def cost(results: Results, case: tuple[str, str], party: str, millimetres: float) -> Cost | None:
    """At an error, between the best settings of a simulator; None where it does not reach the error."""
    records = results.of("equal_error", env=case[0], actions=case[1], party=party)
    best = curves.frontier(Point(r["error"], 1.0 / r["cost"], r) for r in records)
    speed = curves.speed_at(best, 1e-3 * millimetres)
    if speed is None:
        return None
    errors, biases = zip(*((math.log(p.error), p.record["work_bias"]) for p in best), strict=True)
    return Cost(1.0 / speed, float(np.interp(math.log(1e-3 * millimetres), errors, biases)))


def ratio(results: Results, case: tuple[str, str], millimetres: float) -> float | None:
    """How many times what ours costs MuJoCo costs at an error; None where one of them does not reach it."""
    ours, other = (cost(results, case, party, millimetres) for party in (OURS, MUJOCO))
    return other.seconds / ours.seconds if ours and other else None


def render(results: Results, published: bool = False) -> str:
    """The section of the page, whose tables the pages in :data:`PAGES` have where it is published."""
    if published:
        return f"{texts.EQUAL_ERROR}\n\n{texts.ELSEWHERE}"
    rows = []
    for case in cases(results):
        for error in ERRORS:
            cells = [cell for party in (OURS, MUJOCO) for cell in _cells(cost(results, case, party, error))]
            rows.append((f"`{case[0]}`", case[1], f"{error:g}", *cells, _times(ratio(results, case, error))))
    if not rows:
        return ""
    head = ("environment", "actions", "error [mm]", "ours [ms]", "work", "MuJoCo [ms]", "work", "MuJoCo / ours")
    return "\n\n".join((texts.EQUAL_ERROR, table(head, rows), texts.STEPS, _steps(results)))


def costs(results: Results) -> str:
    """The short form of the costs, between its markers."""
    rows = [
        (f"`{env}`", actions, *(_short(results, (env, actions), error) for error in ERRORS))
        for env, actions in cases(results)
    ]
    head = ("environment", "actions", *(f"{error:g} mm" for error in ERRORS))
    return _block(results, texts.EQUAL_ERROR_SHORT, table(head, rows))


def steps(results: Results) -> str:
    """The short form of the environment steps, between its markers."""
    return _block(results, texts.STEPS_SHORT, _steps(results))


def _block(results: Results, *parts: str) -> str:
    machine = [results.machine, *(run["machine"] for run in results.of("run"))][-1]
    return "\n\n".join((BEGIN, *parts, place(machine), END))


PAGES = {ROOT / "README.md": steps, ROOT / "docs" / "accuracy.md": costs}
"""Which block a page has."""


def write_blocks(results: Results) -> None:
    """Replaces the block in every page that has one."""
    for page, block in PAGES.items():
        text = page.read_text()
        before, rest = text.split(BEGIN)
        write_text(page, before + block(results) + rest.split(END, 1)[1])


def _cells(found: Cost | None) -> tuple[str, str]:
    return ("not reached", "-") if found is None else (f"{1e3 * found.seconds:.3g}", f"{100 * found.work_bias:+.1f} %")


def _times(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}x" if value >= 9.5 else f"{value:.1f}x"


def _short(results: Results, case: tuple[str, str], error: float) -> str:
    """Ratio, costs and biases of the work in one cell."""
    both = (_cells(cost(results, case, party, error)) for party in (OURS, MUJOCO))
    costs, biases = (" / ".join(pair) for pair in zip(*both, strict=True))
    return f"**{_times(ratio(results, case, error))}** {costs}; {biases}"


def _steps(results: Results) -> str:
    rows = []
    for env, actions in cases(results):
        shown = results.of("equal_error", env=env, actions=actions, shown=True)
        if len(shown) == 2:
            rows.append((f"`{env}`", actions, *(cell for record in shown for cell in _step_cells(record))))
    columns = ("env-steps/s", "error [mm]", "work")
    return table(("environment", "actions", *columns, *(f"MuJoCo: {name}" for name in columns)), rows)


def _step_cells(record: Record) -> Iterator[str]:
    yield f"{1.0 / (record['period'] * record['cost']):,.0f}"
    yield f"{1e3 * record['error']:.2g}"
    yield f"{100 * record['work_bias']:+.0f} %"
