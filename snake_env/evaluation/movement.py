"""How robots move in an episode: how far without touching anything, and how much their actions chatter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

CHATTER = 4.0
"""Actions that change faster than this count as chatter, which motors filter out and wear from [Hz]."""


class Movement:
    """Of the episodes of a batch, step by step.

    Args:
        num_envs: n.
        control_period: time between two actions [s].
    """

    def __init__(self, num_envs: int, control_period: float) -> None:
        self._actions: list[NDArray[np.float32]] = []
        self._period = control_period
        self.contact_free_progress = np.zeros(num_envs)
        """Progress in steps in which nothing pushed the robot (n,) [m]."""

    def note(self, action: NDArray[np.float32], infos: dict[str, Any], running: NDArray[np.bool_]) -> None:
        """Takes in a step of the robots in ``running`` (n,)."""
        self._actions.append(np.clip(action, -1.0, 1.0).astype(np.float32))
        free = running & (infos["contacts"] == 0)
        self.contact_free_progress[free] += infos["progress"][free]

    def chatter(self, robot: int) -> float:
        """Share of the power of a robot's actions above :data:`CHATTER`, of all that is not constant, up to now."""
        return chatter(np.array([action[robot] for action in self._actions]), self._period)


def chatter(action: NDArray[np.float32], period: float) -> float:
    """Share of the power of a series of actions (T, a) above :data:`CHATTER`; zero where they never change.

    Args:
        action: one row per control period.
        period: the control period [s].
    """
    window = np.hanning(len(action) + 2)[1:-1, None]  # what does not end where it began would leak into all frequencies
    moved = action - np.average(action, axis=0, weights=np.broadcast_to(window, action.shape))
    power = (np.abs(np.fft.rfft(moved * window, axis=0)) ** 2).sum(axis=1)
    fast = np.fft.rfftfreq(len(action), period) > CHATTER
    whole = float(power.sum())
    return float(power[fast].sum()) / whole if whole > 1e-12 else 0.0
