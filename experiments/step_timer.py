"""A process that times environment steps on request; :mod:`experiments.earlier_commit` starts two of them.

Run as a file, with the `snake_env` of either commit on the path, so it imports nothing else of the repository. A line
of its input is a request in JSON: `[id, action mode, actions, robots]` makes a batch, a number lets it take so many
steps. A line of its output is an answer: "made", or the CPU time per robot and step [s].
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import gymnasium as gym
import numpy as np

import snake_env  # noqa: F401

PERIODS = 97
"""Different actions before they repeat."""


def make(name: str, mode: str, actions: str, robots: int) -> tuple[Any, list[Any]]:
    """A reset batch on one thread and its actions; the first release called environments ``-v0``."""
    known = name if name in gym.registry else name.replace("-v1", "-v0")
    options: dict[str, Any] = {} if mode == "gait" else {"action_mode": mode}
    envs: Any = gym.make_vec(
        known, num_envs=robots, num_threads=1, vectorization_mode=gym.VectorizeMode.VECTOR_ENTRY_POINT, **options
    )
    envs.reset(seed=0)
    random, shape = np.random.default_rng(0), envs.action_space.shape
    drawn = (random.uniform(-1.0, 1.0, shape) if actions == "random" else np.zeros(shape) for _ in range(PERIODS))
    return envs, [each.astype(np.float32) for each in drawn]


def main() -> None:
    """Answers until its input ends."""
    envs: Any = None
    sequence: list[Any] = []
    taken = 0
    for line in sys.stdin:
        request = json.loads(line)
        if isinstance(request, list):
            (envs, sequence), taken = make(*request), 0
            print("made", flush=True)
            continue
        begin = time.process_time()
        for _ in range(request):
            envs.step(sequence[taken % PERIODS])
            taken += 1
        print((time.process_time() - begin) / (request * envs.num_envs), flush=True)


if __name__ == "__main__":
    main()
