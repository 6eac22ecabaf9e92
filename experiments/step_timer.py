"""A process that times environment steps; :mod:`experiments.earlier_commit` starts two of them.

Run as a file, with the `snake_env` of either commit on the path, so it imports nothing else of the repository. It
prints the folder of that `snake_env`. A line of its input is a request in JSON: `[id, action mode, actions, robots,
friction at obstacles]` makes a batch, a number advances it by so many control periods. A line of its output is the
reply: "made", "unknown" where the commit has no such environment, or the CPU time per robot and period [s].
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import snake_env

DRAWN = 97
"""Actions before they repeat."""


def make(name: str, mode: str, actions: str, robots: int, peg_friction: float) -> tuple[Any, list[Any]] | None:
    """A reset batch on one thread and its actions; the first commits called environments ``-v0``."""
    known = [each for each in (name, name.replace("-v1", "-v0")) if each in gym.registry]
    if not known:
        return None
    options: dict[str, Any] = {} if mode == "gait" else {"action_mode": mode}
    if peg_friction:
        options["peg_friction"] = (peg_friction, peg_friction)
    envs: Any = gym.make_vec(
        known[0], num_envs=robots, num_threads=1, vectorization_mode=gym.VectorizeMode.VECTOR_ENTRY_POINT, **options
    )
    envs.reset(seed=0)
    random, shape = np.random.default_rng(0), envs.action_space.shape
    drawn = (random.uniform(-1.0, 1.0, shape) if actions == "random" else np.zeros(shape) for _ in range(DRAWN))
    return envs, [each.astype(np.float32) for each in drawn]


def main() -> None:
    """Serves requests until the input ends."""
    print(Path(snake_env.__file__).parent, flush=True)
    envs: Any = None
    actions: list[Any] = []
    period = 0
    for line in sys.stdin:
        request = json.loads(line)
        if isinstance(request, list):
            made = make(*request)
            if made is not None:
                (envs, actions), period = made, 0
            print("unknown" if made is None else "made", flush=True)
            continue
        begin = time.process_time()
        for _ in range(request):
            envs.step(actions[period % DRAWN])
            period += 1
        print((time.process_time() - begin) / (request * envs.num_envs), flush=True)


if __name__ == "__main__":
    main()
