"""The whole of ``step`` around the physics, timed with the physics replaced by nothing."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import snake_env.sb3
from snake_env.evaluation.rollout import make_env
from snake_env.testing import remove_physics


def overhead(env_id: str, num_envs: int, repetitions: int) -> dict[str, Any]:
    """CPU microseconds of a step whose physics does nothing, for both interfaces."""
    vector = make_env(env_id, num_envs, 1, action_mode="gait")
    learner = snake_env.sb3.make(env_id, num_envs, num_threads=1, action_mode="gait")
    vector.reset(seed=0)
    learner.reset()
    actions = np.zeros(vector.action_space.shape, np.float32)
    for env in (vector.unwrapped, learner.env.unwrapped):
        remove_physics(env)
    return {
        "robots": num_envs,
        "Gymnasium [us]": round(_microseconds(lambda: vector.step(actions), repetitions), 2),
        "SB3 [us]": round(_microseconds(lambda: learner.step(actions), repetitions), 2),
    }


def _microseconds(function: Callable[[], Any], repetitions: int, calls: int = 2000) -> float:
    """Median CPU time of a call."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        for _ in range(calls):
            function()
        times.append(1e6 * (time.process_time() - start) / calls)
    return statistics.median(times)
