"""The lines of a learning curve: means over the episodes that ended last."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from training.budget import Budget

EPISODES = 200
"""Finished episodes over which the learning curve is averaged."""

SIGNALS = ("is_success", "distance", "speed", "jam_ratio", "left_corridor")
"""Signals of an episode's last step that the curve shows."""


Note = Callable[[float, Mapping[str, Any]], None]
"""Receives a finished episode: the sum of its rewards, the signals of its last step."""


class LearningCurve:
    """Collects finished episodes and makes a line of them after each update.

    Args:
        budget: of the run; gives the time.
        steps: environment steps taken before.
    """

    def __init__(self, budget: Budget, steps: int = 0) -> None:
        self._budget = budget
        self._ended: deque[dict[str, float]] = deque(maxlen=EPISODES)
        self._last = (budget.seconds, steps)

    def note(self, episode_return: float, signals: Mapping[str, Any]) -> None:
        """Takes note of an episode that has ended, with the signals of its last step."""
        self._ended.append({"return": episode_return, **{key: float(signals[key]) for key in SIGNALS}})

    def row(self, steps: int) -> dict[str, float]:
        """The next line: steps, seconds, rate, means over the last episodes."""
        seconds = self._budget.seconds
        rate = (steps - self._last[1]) / max(seconds - self._last[0], 1e-9)
        self._last = (seconds, steps)
        row = {"steps": steps, "seconds": round(seconds, 2), "steps_per_second": round(rate)}
        for key in ("return", *SIGNALS) if self._ended else ():
            row[key] = round(float(np.mean([episode[key] for episode in self._ended])), 4)
        return row


def text(row: Mapping[str, float]) -> str:
    """A line of the curve for people."""
    return (
        f"{row['steps'] / 1e6:.2f} M steps, {row['steps_per_second'] / 1e3:.1f} k/s, "
        f"success {row.get('is_success', 0.0):.2f}, distance {row.get('distance', 0.0):.2f} m, "
        f"speed {row.get('speed', 0.0):.2f} m/s"
    )
