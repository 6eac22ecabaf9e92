"""What ends a training run: its budget of steps and wall time, or a request to stop."""

from __future__ import annotations

import signal
import threading
import time
from types import FrameType
from typing import Any


class Budget:
    """Steps and wall time that a run may use; counts the time of earlier parts of a resumed run.

    Args:
        total_steps: environment steps, summed over the robots.
        max_minutes: wall time; None: no limit.
        seconds: wall time used before.
    """

    def __init__(self, total_steps: int, max_minutes: float | None, seconds: float = 0.0) -> None:
        self._total_steps = total_steps
        self._max_seconds = float("inf") if max_minutes is None else 60.0 * max_minutes
        self._start = time.monotonic() - seconds
        self._steps = 0

    @property
    def seconds(self) -> float:
        """Wall time used [s]."""
        return time.monotonic() - self._start

    @property
    def out_of_time(self) -> bool:
        """The wall time is used up."""
        return self.seconds >= self._max_seconds

    def note(self, steps: int) -> None:
        """Takes note of the steps taken so far."""
        self._steps = steps

    @property
    def used(self) -> float:
        """Share of the budget that is used up, in [0, 1]."""
        return min(1.0, max(self._steps / self._total_steps, self.seconds / self._max_seconds))


class StopRequest:
    """Ctrl-C or a termination signal makes the run save and stop; a second one interrupts at once.

    Signals reach only the main thread; in another thread this does nothing.
    """

    def __init__(self) -> None:
        self.received = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        heard = (signal.SIGINT, signal.SIGTERM) if threading.current_thread() is threading.main_thread() else ()
        for number in heard:
            self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if self.received:
            raise KeyboardInterrupt
        self.received = True
        print("\nstopping after this step; the run will be saved", flush=True)
