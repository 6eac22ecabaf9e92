"""How many threads step a batch."""

from __future__ import annotations

import os

from snake_env._checks import integer

ENVS_PER_THREAD = 8


def resolve(num_threads: int | None, num_envs: int) -> int:
    """The argument, else the environment variable SNAKE_ENV_NUM_THREADS, else min(cores, ceil(num_envs / 8))."""
    if num_threads is not None:
        return integer("num_threads", num_threads, 1)
    variable = os.environ.get("SNAKE_ENV_NUM_THREADS")
    if variable:
        return integer("SNAKE_ENV_NUM_THREADS", int(variable) if variable.isdecimal() else variable, 1)
    return min(cores(), -(-num_envs // ENVS_PER_THREAD))


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
