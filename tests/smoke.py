"""What must work in an installation without extras: run by `make wheels` with the Python of a clean environment."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import gymnasium
import numpy as np

import snake_env


def main() -> None:
    """Environments, simulation, threads, policies, commands."""
    assert "site-packages" in snake_env.__file__, snake_env.__file__
    assert version("snake-robot-env") == snake_env.__version__
    envs = gymnasium.make_vec("SnakeField-v1", num_envs=8)
    envs.reset(seed=0)
    assert np.isfinite(envs.step(envs.action_space.sample())[0]).all()
    env = gymnasium.make("snake_env:SnakeSpatial-v1")
    env.reset(seed=0)
    assert snake_env.simulate(duration=0.5).unconverged.sum() == 0
    with ThreadPoolExecutor(4) as threads:
        first, *others = threads.map(place_after_a_second, [1, 2, 1, 2])
    assert all((first == other).all() for other in others)
    # An extension that is not made for it would have switched the lock on.
    assert sysconfig.get_config_var("Py_GIL_DISABLED") != 1 or not sys._is_gil_enabled()
    for name in snake_env.policies.NAMES:
        policy = snake_env.load_policy(name)
        batch = policy.make_vec(2)
        assert np.isfinite(policy(batch.reset(seed=0)[0])).all()
        assert policy.card.scores
    command = str(Path(sys.executable).with_name("snake-env"))
    with tempfile.TemporaryDirectory() as folder:
        for arguments in (["card", "field-hard"], ["bench", "--seconds", "0.1"], ["--help"]):
            subprocess.run([command, *arguments], check=True, capture_output=True, cwd=folder)
    print(
        f"snake-robot-env {snake_env.__version__}, Python {sys.version.split()[0]}, Gymnasium {gymnasium.__version__}"
    )


def place_after_a_second(num_threads: int) -> np.ndarray:
    """Of 40 robots in a batch of its own."""
    envs = snake_env.SnakeVectorEnv(40, num_threads=num_threads)
    envs.reset(seed=0)
    for _ in range(20):
        envs.step(np.full(envs.action_space.shape, 0.5))
    return envs.state().link_position


if __name__ == "__main__":
    main()
