"""How the wall time of learning divides between simulator and learner."""

from __future__ import annotations

import time
from typing import Any

import torch

import snake_env.sb3
from training.budget import Budget
from training.config import Sb3Config, load_as
from training.learners.sb3 import new_model


def learning(env_id: str, rollouts: int) -> dict[str, Any]:
    """Wall time of simulator and learner in Stable-Baselines3's PPO, with the settings of the README's lines.

    The simulator takes up to eight cores, the learner one. Weights are random at first. The first rollout and its
    update, in which memory is obtained, do not count.
    """
    config = load_as(Sb3Config, "sb3")
    torch.set_num_threads(config.torch_threads)
    env = snake_env.sb3.make(env_id, config.num_envs)
    simulating, step_wait = [0.0], env.step_wait

    def timed() -> Any:
        start = time.perf_counter()
        result = step_wait()
        simulating[0] += time.perf_counter() - start
        return result

    env.step_wait = timed  # type: ignore[method-assign]
    rollout = config.num_envs * config.ppo.n_steps
    model = new_model(config, env, Budget(rollouts * rollout))
    model.learn(rollout)
    simulating[0], start = 0.0, time.perf_counter()
    model.learn(rollouts * rollout, reset_num_timesteps=False)
    seconds, steps = time.perf_counter() - start, rollouts * rollout
    env.close()
    return {
        "env": env_id,
        "robots": config.num_envs,
        "simulator [us]": round(1e6 * simulating[0] / steps, 2),
        "learner [us]": round(1e6 * (seconds - simulating[0]) / steps, 2),
    }
