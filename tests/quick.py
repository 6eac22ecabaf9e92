"""A glance at environments with a native module that `make check` has just compiled: python tests/quick.py MODULE."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np

STEPS = 10


def load(path: str) -> None:
    """Makes the module at ``path`` the one that the package imports, whatever is installed."""
    spec = importlib.util.spec_from_file_location("snake_env._native", path)
    if spec is None or spec.loader is None:
        raise SystemExit(f"{path} is no extension module")
    sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[spec.name])


def main() -> None:
    """Random actions in both models: finite observations, no robot that diverges, and a reset that repeats them."""
    load(sys.argv[1])
    from snake_env import SnakeVectorEnv

    for model, task in (("planar", "course"), ("planar", "field"), ("spatial", "field")):
        runs = []
        for _ in range(2):
            envs = SnakeVectorEnv(8, task=task, model=model)
            random = np.random.default_rng(0)
            observations, _ = envs.reset(seed=0)
            for _ in range(STEPS):
                actions = random.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
                observations, _, _, _, info = envs.step(actions)
                assert not np.any(info["diverged"]), (model, task)
            assert np.all(np.isfinite(observations)), (model, task)
            runs.append(observations)
        assert np.array_equal(*runs), (model, task)
    print("environments step")


if __name__ == "__main__":
    main()
