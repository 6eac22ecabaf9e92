"""The built-in reward terms as functions, to build reward functions from.

Each takes (state, action, previous_action), as :data:`snake_env.options.RewardFn`, and returns (m,) values without
weight; the built-in reward is their sum with ``reward_weights``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.state import Array, State

Action = NDArray[np.float32]


def progress(state: State, action: Action, previous_action: Action) -> Array:
    """Distance of the centre of gravity towards the goal, gained in this step [m]."""
    return state["progress"]


def energy(state: State, action: Action, previous_action: Action) -> Array:
    """Minus the positive work of the actuators [J]."""
    return -state["positive_work"]


def smoothness(state: State, action: Action, previous_action: Action) -> Array:
    """Minus the mean squared change of the action."""
    change: NDArray[Any] = np.clip(action, -1.0, 1.0).astype(np.float64) - np.clip(previous_action, -1.0, 1.0)
    return -np.square(change).mean(axis=1)


def success(state: State, action: Action, previous_action: Action) -> Array:
    """1 where the goal has been reached, which ends the episode."""
    return state["is_success"].astype(np.float64)
