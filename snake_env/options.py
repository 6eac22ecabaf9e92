"""The keyword arguments that all environment classes share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from snake_env.config import PD, Integrator, IOLinearizing, PerLink, Randomization, Robot, Scene, Start, Stribeck
from snake_env.state import State

RewardFn: TypeAlias = Callable[[State, NDArray[np.float32], NDArray[np.float32]], NDArray[np.float64]]
"""``reward_fn(state, action, previous_action)`` for m robots at once -> (m,) rewards, which ``info`` has as
``reward_custom`` in place of the built-in terms.

``state`` is the :class:`snake_env.State` after the step, and ``state["distance"]`` the entry of ``info`` of that name;
the actions are (m, a), as given to ``step``, and ``previous_action`` is zero in the first step of an episode. The terms
of :mod:`snake_env.rewards` are such functions.
"""

TerminationFn: TypeAlias = Callable[[State, NDArray[np.float32], NDArray[np.float32]], NDArray[np.bool_]]
"""``termination_fn(state, action, previous_action)`` for m robots at once -> bool (m,), which robots' episodes end; on
top of ``termination``.
"""


class TaskOptions(TypedDict, total=False):
    """Configuration of an environment; see ``docs/environments.md`` for meanings, ranges and defaults.

    Nested sections may be given as mappings, which keeps the environment's spec serialisable as JSON.
    """

    robot_class: str | None
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
    speed: tuple[float, float]
    difficulty: float
    field: str
    terrain: str
    push_points: int
    perturbation: Mapping[str, Any]
    randomization: Randomization | Mapping[str, Any]
    scene: Scene | Sequence[Scene] | str | Path | Callable[[np.random.Generator, float], Scene] | None
    start: Start | Mapping[str, Any] | None
    goal: float | tuple[float, ...] | Sequence[Sequence[float]] | Mapping[str, Any] | None
    corridor: tuple[float, float] | None
    peg_friction: tuple[float, float] | None
    observation_blocks: Sequence[str] | None
    privileged: bool
    observation_noise: Mapping[str, float]
    observation_delay: Mapping[str, float]
    imu_link: int
    range_link: int
    encoder_resolution: float
    energy: str
    termination: Mapping[str, bool]
    friction: tuple[float, float] | None
    friction_backward: float | None
    stribeck: Stribeck | Mapping[str, float]
    slope: tuple[float, float]
    controller: PD | IOLinearizing | str | Mapping[str, Any]
    precision: str
    integrator: Integrator | Mapping[str, Any]
    robot: Robot | Mapping[str, int | PerLink]
    reward_weights: Mapping[str, float]
    start_jitter: float
