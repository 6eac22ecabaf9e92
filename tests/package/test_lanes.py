"""The environment variable SNAKE_ENV_LANES, in processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys

PROGRAM = """
import hashlib
import gymnasium as gym
import numpy as np
import snake_env
from snake_env import _native

envs = gym.make_vec("SnakeField-v1", num_envs=6, num_threads=1)
observation, _ = envs.reset(seed=3)
envs.action_space.seed(4)
rows = [observation.copy()]
for _ in range(12):
    rows.append(envs.step(envs.action_space.sample())[0].copy())
print(_native.lanes(), hashlib.sha256(np.stack(rows).tobytes()).hexdigest())
"""


def run(lanes: str | None) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "SNAKE_ENV_LANES"}
    if lanes is not None:
        environment["SNAKE_ENV_LANES"] = lanes
    return subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False)


def test_every_width_steps_alike_to_the_bit() -> None:
    widest, width, one, digest = *run(None).stdout.split(), *run("1").stdout.split()
    assert one == "1"
    assert digest == width
    for lanes in {"4", widest} & {"4", "8"} if widest != "1" else set():
        assert run(lanes).stdout.split() == [lanes, digest]


def test_a_width_that_the_processor_lacks_is_refused() -> None:
    refused = run("3")
    assert refused.returncode != 0
    assert 'ConfigError: SNAKE_ENV_LANES = "3": expected one of [1' in refused.stderr
