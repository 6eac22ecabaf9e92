"""The environment ids."""

from __future__ import annotations

import gymnasium as gym

MAX_EPISODE_STEPS = 600

TASKS = {
    "SnakeCourse-v0": "course",
    "SnakeField-v0": "field",
    "SnakeFree-v0": "free",
    "SnakePerturbed-v0": "perturbed",
    "SnakeMaze-v0": "maze",
    "SnakeCorridor-v0": "corridor",
}


def register() -> None:
    """Registers the ids with Gymnasium, single and vector entry point each."""
    for env_id, task in TASKS.items():
        if env_id not in gym.registry:
            gym.register(
                env_id,
                entry_point="snake_env.env:SnakeEnv",
                vector_entry_point="snake_env.vector_env:SnakeVectorEnv",
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs={"task": task},
            )
