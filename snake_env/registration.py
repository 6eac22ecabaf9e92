"""The environment ids."""

from __future__ import annotations

import gymnasium as gym

MAX_EPISODE_STEPS = 600

TASKS: dict[str, dict[str, str]] = {
    "SnakeCourse-v0": {"task": "course"},
    "SnakeField-v0": {"task": "field"},
    "SnakeFree-v0": {"task": "free"},
    "SnakePerturbed-v0": {"task": "perturbed"},
    "SnakeMaze-v0": {"task": "maze"},
    "SnakeCorridor-v0": {"task": "corridor"},
    "SnakeSpatial-v0": {"model": "spatial", "task": "free"},
}
"""Keywords that make each environment what it is."""

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
