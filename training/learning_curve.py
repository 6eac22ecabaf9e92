"""The lines of a learning curve: means over the episodes that ended last, with several tasks over the tasks' means."""

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
        self._ended: dict[str, deque[dict[str, float]]] = {}
        self._last = (budget.seconds, steps)

    def note(self, episode_return: float, signals: Mapping[str, Any]) -> None:
        """Takes note of an episode that has ended, with the signals of its last step, and of its task if it has one."""
        ended = self._ended.setdefault(str(signals.get("task", "")), deque(maxlen=EPISODES))
        ended.append({"return": float(episode_return), **{key: float(signals[key]) for key in SIGNALS}})

    def row(self, steps: int) -> dict[str, float]:
        """The next line: steps, seconds, rate, means over the last episodes."""
        seconds = self._budget.seconds
        rate = (steps - self._last[1]) / max(seconds - self._last[0], 1e-9)
        self._last = (seconds, steps)
        row = {"steps": steps, "seconds": round(seconds, 2), "steps_per_second": round(rate)}
        for key in ("return", *SIGNALS) if self._ended else ():
            means = {task: float(np.mean([one[key] for one in ended])) for task, ended in sorted(self._ended.items())}
            row[key] = round(float(np.mean(list(means.values()))), 4)
            row |= {f"{key}/{task}": round(mean, 4) for task, mean in means.items() if task}
        return row

    def state(self) -> dict[str, list[dict[str, float]]]:
        """The episodes that ended last, by task."""
        return {task: list(ended) for task, ended in self._ended.items()}

    def restore(self, state: Mapping[str, list[dict[str, float]]]) -> None:
        """Takes over what :meth:`state` returned."""
        self._ended = {task: deque(ended, maxlen=EPISODES) for task, ended in state.items()}


def text(row: Mapping[str, float]) -> str:
    """A line of the curve for people."""
    return (
        f"{row['steps'] / 1e6:.2f} M steps, {row['steps_per_second'] / 1e3:.1f} k/s, "
        f"success {row.get('is_success', 0.0):.2f}, distance {row.get('distance', 0.0):.2f} m, "
        f"speed {row.get('speed', 0.0):.2f} m/s"
    )
