"""The keyword arguments that all environment classes share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from snake_env.config import PD, Integrator, IOLinearizing, PerLink, Randomization, Robot, Stribeck

RewardFn: TypeAlias = Callable[[dict[str, NDArray[Any]], NDArray[np.float32], NDArray[np.float32]], NDArray[np.float64]]
"""``reward_fn(signals, action, previous_action)`` for m robots at once -> (m,) rewards.

``signals`` holds the arrays of ``info`` by name, each (m,); the actions are (m, a), as given to ``step``, and
``previous_action`` is zero in the first step of an episode.
"""


class TaskOptions(TypedDict, total=False):
    """Configuration of an environment; see ``docs/environments.md`` for meanings, ranges and defaults.

    Nested sections may be given as mappings, which keeps the environment's spec serialisable as JSON.
    """

    model: str
    task: str
    action_mode: str
    perception: str
    nearest_pegs: int
    control_period: float
    goal_distance: float
    corridor_half_width: float
    goal_radius: float
    turn: float
    difficulty: float
    field: str
    push_points: int
    perturbation: Mapping[str, Any]
    randomization: Randomization | Mapping[str, Any]
    friction: tuple[float, float] | None
    stribeck: Stribeck | Mapping[str, float]
    controller: PD | IOLinearizing | str | Mapping[str, Any]
    integrator: Integrator | Mapping[str, Any]
    robot: Robot | Mapping[str, int | PerLink]
    reward_weights: Mapping[str, float]
    start_jitter: float
