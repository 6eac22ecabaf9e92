"""Broken joints (T ch. 8), of which the thesis asks that a robot stays operational."""

from __future__ import annotations

from snake_env.reproduce.broken import remaining
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows

TAIL = slice(6, None)
"""The last four joints."""
MIDDLE = slice(3, 5)

rows = Rows("8")


def _shares(ways: list[float]) -> str:
    return ", ".join(f"{way:.0%}" for way in ways)


@rows.ours(
    "one broken joint, orthotropic ground",
    bound="over 60 % of the way, whichever joint is locked or limp: the wave of the other nine still pushes",
)
def _on_open_ground(runs: Runs) -> Result:
    locked, limp = (remaining(runs, "orthotropic", way) for way in ("locked", "limp"))
    ours = f"{min(locked):.0%} to {max(locked):.0%} of the way with a locked joint, {min(limp):.0%} to {max(limp):.0%} "
    return ours + "with a limp one", min(locked + limp) > 0.6 and max(locked + limp) < 1.05


@rows.ours(
    "one locked joint among pegs",
    bound="at least four of ten cost less than 10 % of the way, the others half or more of it but not all: where its "
    "bend is in the way of a peg the robot jams",
)
def _locked_among_pegs(runs: Runs) -> Result:
    ways = remaining(runs, "table 7.5", "locked")
    passed = [way for way in ways if way > 0.9]
    jammed = [way for way in ways if way <= 0.9]
    return f"from the first to the last joint {_shares(ways)}", len(passed) >= 4 and all(0.2 < w < 0.6 for w in jammed)


@rows.ours(
    "one limp joint among pegs",
    bound="over 95 % of the way with one of the last four, under 10 % with one of the middle two: it passes on no "
    "push, which the tail can do without",
)
def _limp_among_pegs(runs: Runs) -> Result:
    ways = remaining(runs, "table 7.5", "limp")
    return f"from the first to the last joint {_shares(ways)}", min(ways[TAIL]) > 0.95 and max(ways[MIDDLE]) < 0.1
