"""The table of findings: what the thesis says, what comes out here, and what follows for the thesis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from snake_env.reproduce.experiment import Runs

SECTIONS = (
    "2.3.2",
    "2.4.1",
    "2.4.2",
    "5.3",
    "6.3.3",
    "7.3.1",
    "7.3.2",
    "7.3.3",
    "7.3.4",
    "7.3.5",
    "7.5.1",
    "7.5.2",
    "7.5.3",
    "7.6",
    "8",
)
"""Sections of the thesis with results of its three models."""

Result = tuple[str, bool]
"""What comes out here, and whether it is within the bound of its row."""


class Verdict(str, Enum):
    """What a row that holds says about the thesis."""

    REPRODUCED = "reproduced"
    """The thesis's words or numbers come out."""
    CORRECTED = "refuted or refined"
    """They do not come out, or only with a restriction; the row has the reason."""
    OURS = "ours"
    """The thesis makes no such statement."""


@dataclass(frozen=True)
class Finding:
    """One row of the table.

    Attributes:
        section: of the thesis.
        name: what is found.
        verdict: what the row says about the thesis if it holds.
        thesis: the thesis's words or number; empty if it has none.
        ours: what comes out here.
        bound: what the row demands of it, and why so much.
        reason: why the thesis is refuted or refined.
        independent: figures of other implementations of the thesis's models, and their source.
        holds: what comes out is within the bound.
    """

    section: str
    name: str
    verdict: Verdict
    thesis: str
    ours: str
    bound: str
    reason: str
    independent: str
    holds: bool


@dataclass(frozen=True)
class Check:
    """A row before it is measured; attributes as in :class:`Finding`."""

    section: str
    name: str
    verdict: Verdict
    thesis: str
    bound: str
    reason: str
    independent: str
    test: Callable[[Runs], Result]

    def finding(self, runs: Runs) -> Finding:
        """The row."""
        ours, holds = self.test(runs)
        words = (self.thesis, ours, self.bound, self.reason, self.independent)
        return Finding(self.section, self.name, self.verdict, *words, bool(holds))


Decorator = Callable[[Callable[[Runs], Result]], Callable[[Runs], Result]]


@dataclass
class Rows:
    """The rows of one section; each method is a decorator of the function that measures the row."""

    section: str
    checks: list[Check] = field(default_factory=list)

    def reproduced(self, name: str, thesis: str, bound: str, independent: str = "") -> Decorator:
        """A statement of the thesis that comes out."""
        return self._row(Verdict.REPRODUCED, name, thesis, bound, "", independent)

    def corrected(self, name: str, thesis: str, bound: str, reason: str, independent: str = "") -> Decorator:
        """A statement of the thesis that does not come out, or only with a restriction."""
        return self._row(Verdict.CORRECTED, name, thesis, bound, reason, independent)

    def ours(self, name: str, bound: str, independent: str = "") -> Decorator:
        """A finding about which the thesis is silent."""
        return self._row(Verdict.OURS, name, "", bound, "", independent)

    def _row(self, verdict: Verdict, name: str, thesis: str, bound: str, reason: str, independent: str) -> Decorator:
        def register(test: Callable[[Runs], Result]) -> Callable[[Runs], Result]:
            self.checks.append(Check(self.section, name, verdict, thesis, bound, reason, independent, test))
            return test

        return register
