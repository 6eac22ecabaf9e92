"""The built-in reward terms as functions, to build reward functions from.

Each takes (state, action, previous_action), as :data:`snake_env.options.RewardFn`, and returns (m,) values without
weight; the built-in reward is their sum with ``reward_weights``, ``state.reward_terms @ weights``.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from snake_env._native import defaults
from snake_env.state import Array, State

Action = NDArray[Any]

TERMS: tuple[str, ...] = tuple(defaults("environment")["reward_weights"])
"""Names of the terms, in the order of ``state.reward_terms``."""


def term(state: State, name: str) -> Array:
    """The values of a term (m,)."""
    return state.reward_terms[:, TERMS.index(name)]


def progress(state: State, action: Action, previous_action: Action) -> Array:
    """Distance of the centre of gravity towards the goal, gained in this step; 0 with a commanded speed [m]."""
    return term(state, "progress")


def tracking(state: State, action: Action, previous_action: Action) -> Array:
    """Length of the commanded displacement of the centre of gravity in this step, minus its distance from the actual
    one [m]. 0 without a commanded speed.
    """
    return term(state, "tracking")


def energy(state: State, action: Action, previous_action: Action) -> Array:
    """Minus the positive work of the actuators [J]."""
    return term(state, "energy")


def smoothness(state: State, action: Action, previous_action: Action) -> Array:
    """Minus the mean squared change of the action."""
    return term(state, "smoothness")


def success(state: State, action: Action, previous_action: Action) -> Array:
    """1 in the step that reaches the goal."""
    return term(state, "success")
