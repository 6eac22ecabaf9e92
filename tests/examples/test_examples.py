"""The examples run as they stand, for a few steps."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import snake_env

ROOT = Path(__file__).parents[2]


def run(name, *arguments, **environment):
    command = [sys.executable, str(ROOT / "examples" / name), *arguments]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]), **environment}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_ppo_learns_from_a_batch():
    pytest.importorskip("torch")
    printed = run("ppo.py", "--num-envs", "4", "--steps", "8", "--total-steps", "64")
    assert "iteration 1 " in printed


def test_skrl_learns_from_a_batch(tmp_path):
    pytest.importorskip("skrl")
    printed = run("skrl_ppo.py", "--num-envs", "4", "--total-steps", "512", "--out", str(tmp_path))
    assert "512 steps" in printed
    assert list(tmp_path.glob("*/checkpoints/*.pt"))


def test_a_minari_dataset_holds_the_episodes(tmp_path):
    minari = pytest.importorskip("minari")
    for needed in ("h5py", "jax"):
        pytest.importorskip(needed)
    arguments = ("--dataset", "snake/test-v0", "--episodes", "2", "--env", "SnakeFree-v1")
    assert run("minari_dataset.py", *arguments, MINARI_DATASETS_PATH=str(tmp_path)).startswith("2 episodes")
    os.environ["MINARI_DATASETS_PATH"] = str(tmp_path)
    episode = next(iter(minari.load_dataset("snake/test-v0").iterate_episodes()))
    env = snake_env.SnakeEnv(task="free", max_episode_steps=600)
    np.testing.assert_array_equal(episode.observations[0], env.reset(seed=0)[0])
    assert bool(episode.terminations[-1]) != bool(episode.truncations[-1])


def test_tensors_share_the_memory_of_observations_and_stay():
    """Neither ``from_numpy`` nor dlpack copies, and later steps write elsewhere."""
    torch = pytest.importorskip("torch")
    env = snake_env.SnakeVectorEnv(8, task="free")
    kept = []
    observation, _ = env.reset(seed=0)
    for k in range(12):
        convert = torch.from_dlpack if k % 2 else torch.from_numpy
        tensor = convert(observation)
        assert tensor.data_ptr() == observation.ctypes.data
        kept.append((tensor, observation.copy()))
        observation = env.step(np.ones((8, 4), np.float32))[0]
    for tensor, before in kept:
        np.testing.assert_array_equal(tensor.numpy(), before)
