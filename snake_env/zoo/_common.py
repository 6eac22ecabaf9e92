"""What the hyperparameters of all algorithms share."""

from __future__ import annotations

from typing import Any

from snake_env.registration import TASKS


def for_all_environments(**hyperparameters: Any) -> dict[str, dict[str, Any]]:
    """The same hyperparameters for each environment, over the native batch.

    ``normalize`` is left out: observations are scaled already.
    """
    return {
        env_id: {
            "policy": "MlpPolicy",
            "vec_env_wrapper": {"snake_env.sb3.native": {"env_id": env_id}},
            **hyperparameters,
        }
        for env_id in TASKS
    }
