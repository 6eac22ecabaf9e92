"""The environment ids."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from snake_env._native import defaults, scenarios

MAX_EPISODE_STEPS: int = defaults("environment")["max_episode_steps"]
CONTROL_PERIOD: float = defaults("environment")["control_period"]

SCENARIOS: list[dict[str, Any]] = scenarios()
"""The families of scenes, as the core registers them."""

_CONTROLLER: dict[str, Any] = defaults("environment")["controller"]


def _keywords(row: dict[str, Any]) -> dict[str, Any]:
    """What differs from the defaults of the environments."""
    own = {"task": row["name"]}
    if row["model"] != "planar":
        own["model"] = row["model"]
    if row["torque_limit"] != _CONTROLLER["torque_limit"]:
        own["controller"] = _CONTROLLER | {"torque_limit": row["torque_limit"]}
    return own


TASKS: dict[str, dict[str, Any]] = {
    **{row["id"]: _keywords(row) for row in SCENARIOS},
    "SnakeSpatial-v1": {"model": "spatial", "task": "free"},
}
"""Keywords that make each environment what it is."""

DESCRIPTIONS: dict[str, str] = {
    **{row["id"]: row["description"] for row in SCENARIOS},
    "SnakeSpatial-v1": "The robot in 3D (chapter 4 of the thesis). Joints bend sideways and up and down; links lift, "
    "roll and press on the ground with forces of their own. There are no pegs and the ground is isotropic, on which "
    "planar undulation makes no headway. The robot starts perpendicular to the goal direction, and action zero is the "
    "sidewinding of (7.5). Phase shift zero with a small amplitude rolls it (7.3.2). With `task` it goes where the "
    'planar robot goes: `gymnasium.make("SnakeSpatial-v1", task="field")` is the field of pegs in 3D. There action '
    "zero is the flat gait (7.3). A picture shows it from above and, in a strip below, from the side.",
}
"""What each environment is."""

OWN_ID = f"an id of one of this package's environments, such as {', '.join(TASKS)}"
"""What an environment id has to be, where no other will do."""


def register() -> None:
    """Registers the ids with Gymnasium, single and vector entry point each."""
    for env_id, options in TASKS.items():
        if env_id not in gym.registry:
            gym.register(
                env_id,
                entry_point="snake_env.env:SnakeEnv",
                vector_entry_point="snake_env.vector_env:SnakeVectorEnv",
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs=dict(options),
            )
