"""What surrounds the physics: the interface, timed with the physics replaced by nothing, and a learner."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

import snake_env.sb3
from snake_env.evaluation.rollout import make_env
from snake_env.testing import remove_physics
from training.budget import Budget
from training.config import Sb3Config, load_as
from training.learners.sb3 import new_model


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


def learning(env_id: str, rollouts: int) -> dict[str, Any]:
    """Wall time of simulator and learner in Stable-Baselines3's PPO, with the settings of the README's lines.

    The simulator takes up to eight cores, the learner one. Weights are random at first. The first
    rollout and its update, in which memory is obtained, do not count.
    """
    config = load_as(Sb3Config, "sb3")
    torch.set_num_threads(config.torch_threads)
    env = snake_env.sb3.make(env_id, config.num_envs)
    simulating, step_wait = [0.0], env.step_wait

    def timed() -> Any:
        start = time.perf_counter()
        try:
            return step_wait()
        finally:
            simulating[0] += time.perf_counter() - start

    env.step_wait = timed  # type: ignore[method-assign]
    rollout = config.num_envs * config.ppo.n_steps
    model = new_model(config, env, Budget(rollouts * rollout))
    model.learn(rollout)
    simulating[0], start = 0.0, time.perf_counter()
    model.learn(rollouts * rollout, reset_num_timesteps=False)
    seconds, steps = time.perf_counter() - start, rollouts * rollout
    return {
        "env": env_id,
        "robots": config.num_envs,
        "simulator [us]": round(1e6 * simulating[0] / steps, 2),
        "learner [us]": round(1e6 * (seconds - simulating[0]) / steps, 2),
    }
