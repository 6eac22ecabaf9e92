"""What ends a training run: its budget of environment steps, or a request to stop; and the wall time that it takes."""

from __future__ import annotations

import signal
import threading
import time
from types import FrameType
from typing import Any


class Budget:
    """Environment steps that a run may take, and the wall time used, that of earlier parts of a resumed run included.

    Nothing that is learned depends on the wall time: the same configuration gives the same policy on a slow machine.

    Args:
        total_steps: environment steps, summed over the robots.
        steps: steps taken before.
        seconds: wall time used before.
    """

    def __init__(self, total_steps: int, steps: int = 0, seconds: float = 0.0) -> None:
        self._total_steps = total_steps
        self._start = time.monotonic() - seconds
        self._steps = steps

    @property
    def seconds(self) -> float:
        """Wall time used [s]."""
        return time.monotonic() - self._start

    def note(self, steps: int) -> None:
        """Takes note of the steps taken so far."""
        self._steps = steps

    @property
    def used(self) -> float:
        """Share of the budget that is used up, in [0, 1]."""
        return min(1.0, self._steps / self._total_steps)


class Interval:
    """Equal intervals of environment steps.

    Args:
        length: steps from one to the next; zero: every call is due; None: none ever is.
        steps: steps taken before.
    """

    def __init__(self, length: int | None, steps: int = 0) -> None:
        self._length = length
        self._done = self._number(steps)

    def _number(self, steps: int) -> int:
        return steps // self._length if self._length else 0

    def due(self, steps: int) -> bool:
        """Whether another interval has ended since the last call that returned True."""
        before, self._done = self._done, self._number(steps)
        return self._length == 0 or self._done > before


class StopRequest:
    """Ctrl-C or a termination signal makes the run save and stop; a second one interrupts at once.

    Signals reach only the main thread; in another thread this does nothing.
    """

    SIGNALS: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self._asked = False
        self._before: dict[int, Any] = {}

    @property
    def received(self) -> bool:
        """Whether a signal to stop has been received."""
        return self._asked

    def __enter__(self) -> StopRequest:
        heard = self.SIGNALS if threading.current_thread() is threading.main_thread() else ()
        for number in heard:
            self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if self._asked:
            raise KeyboardInterrupt
        self._asked = True
        print("\nstopping after this step; the run will be saved", flush=True)
