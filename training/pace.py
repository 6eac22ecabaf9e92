"""How often a command that takes long says where it is."""

from __future__ import annotations

import sys
import time

IN_A_TERMINAL, IN_A_FILE = 5.0, 60.0
"""Seconds between two lines of progress."""


class Pace:
    """Lines of progress, every few seconds in a terminal and once a minute in a file."""

    def __init__(self) -> None:
        self._seconds = IN_A_TERMINAL if sys.stdout.isatty() else IN_A_FILE
        self._shown = time.monotonic()

    def due(self) -> bool:
        """Whether it is time for a line; the time to the next one then begins."""
        now = time.monotonic()
        if now - self._shown < self._seconds:
            return False
        self._shown = now
        return True
