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

envs = gym.make_vec("SnakeField-v1", num_envs=13, num_threads=1)
observation, _ = envs.reset(seed=3)
envs.action_space.seed(4)
rows = [observation.copy()]
for _ in range(12):
    rows.append(envs.step(envs.action_space.sample())[0].copy())
digest = hashlib.sha256(np.stack(rows).tobytes())
for model in "planar", "spatial":
    # Joints that press their stops, and those of robots beside them that leave theirs.
    robot, integrator = snake_env.Robot(links=3, joint_limit=0.5), snake_env.Integrator(order=1)
    options = dict(model=model, action_mode="torques", robot=robot, integrator=integrator, num_threads=1)
    envs = snake_env.SnakeVectorEnv(5, start=snake_env.Start(posture="straight"), **options)
    envs.reset(seed=0)
    for k in range(24):
        actions = np.ones(envs.action_space.shape, np.float32)
        actions[0] *= 1 if k < 10 else -1
        actions[1:] *= np.sin(0.3 * k + np.arange(4))[:, None]
        envs.step(actions)
    digest.update(envs.state().joint_angle.tobytes())
print(_native.lanes(), digest.hexdigest())
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
