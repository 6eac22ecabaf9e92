"""The table of findings: what the thesis says, what comes out here, and whether the two agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from snake_env.reproduce.experiments import Runs

SECTIONS = ("2.4.2", "7.3.1", "7.3.2", "7.3.3", "7.3.4", "7.3.5", "7.5.1", "7.5.2", "7.5.3")
"""Sections of the thesis with results of its three models."""


@dataclass(frozen=True)
class Finding:
    """One row of the table.

    Attributes:
        section: of the thesis.
        name: what is found.
        thesis: the thesis's words or number.
        ours: what comes out here.
        passed: the two agree.
    """

    section: str
    name: str
    thesis: str
    ours: str
    passed: bool


@dataclass(frozen=True)
class Check:
    """How a row comes about: ``test`` returns our words and whether they agree with the thesis's."""

    section: str
    name: str
    thesis: str
    test: Callable[[Runs], tuple[str, bool]]

    def finding(self, runs: Runs) -> Finding:
        """The row."""
        ours, passed = self.test(runs)
        return Finding(self.section, self.name, self.thesis, ours, bool(passed))
