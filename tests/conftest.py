"""Shared by the tests of the Python package; they run on few cores, so nothing starts threads unasked."""

from __future__ import annotations

import os

os.environ.setdefault("SNAKE_ENV_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import re
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import settings

import snake_env
from snake_env import Integrator, IOLinearizing
from snake_env.registration import TASKS

# A shell ignores Ctrl-C in what it runs in the background; the programs that tests interrupt would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run of the suite; `make fuzz` looks for new ones.
settings.register_profile("repeatable", derandomize=True)
settings.register_profile("search")
settings.load_profile(os.environ.get("SNAKE_ENV_FUZZ", "repeatable"))

ENV_IDS = tuple(TASKS)
MODES = ("NextStep", "SameStep", "Disabled")


@pytest.fixture(scope="module")
def cluster():
    """A local Ray cluster of two nodes with one CPU each: two actors cannot be on one of them."""
    ray = pytest.importorskip("ray")
    nodes = import_module("ray.cluster_utils").Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False}
    )
    nodes.add_node(num_cpus=1)
    ray.init(address=nodes.address, include_dashboard=False)
    yield nodes
    ray.shutdown()
    nodes.shutdown()


@pytest.fixture(
    params=[
        {"model": "minimal"},
        {"integrator": Integrator(method="thesis")},
        {"model": "spatial", "integrator": Integrator(method="thesis")},
        {"controller": IOLinearizing()},
    ],
    ids=("minimal", "thesis", "spatial thesis", "io"),
)
def simple_ground(request: pytest.FixtureRequest) -> dict[str, Any]:
    """Keywords of runs whose ground has the same friction everywhere and both ways."""
    return request.param


@pytest.fixture(params=ENV_IDS)
def env_id(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def make() -> Callable[..., Any]:
    """Short episodes of the field, natively."""
    return partial(gym.make_vec, "SnakeField-v1", max_episode_steps=9)


def check_arrays(trajectory: snake_env.Trajectory, **shapes: tuple[int, ...]) -> None:
    """Those named have the shapes given, those of the solver one entry a sample; all are C-contiguous float64."""
    rows = len(trajectory.time)
    per_sample = ("time", "residual", "iterations", "unconverged", "fallbacks", "energy")
    for name, shape in (shapes | dict.fromkeys(per_sample, ())).items():
        array = getattr(trajectory, name)
        assert (array.shape, array.dtype) == ((rows, *shape), np.float64), name
        assert array.flags.c_contiguous, name


def check_continues(env: snake_env.SnakeEnv, quantity: str) -> None:
    """A saved state brings back a quantity of the state, the observations of 20 steps, which are dicts, and the
    quantity after them."""

    def steps() -> list[dict[str, np.ndarray]]:
        seen = [env.step(np.zeros(env.action_space.shape))[0] for _ in range(20)]
        return [*seen, {quantity: getattr(env.state(), quantity)}]

    saved, before, after = env.get_state(), getattr(env.state(), quantity), steps()
    env.reset(seed=1)
    env.set_state(saved)
    np.testing.assert_array_equal(getattr(env.state(), quantity), before)
    for one, other in zip(after, steps(), strict=True):
        for name, block in one.items():
            np.testing.assert_array_equal(block, other[name])


def in_mujoco(scene: snake_env.Scene, **options: Any) -> tuple[Any, Any]:
    """Model and data of MuJoCo at the start."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(scene.to_mjcf(**options))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    return model, data


def advance(model: Any, data: Any, seconds: float, targets: Callable[[float], Any] | None = None) -> None:
    """Steps of MuJoCo, and the places of bodies after them; ``targets`` are the servos' at the end of each step."""
    mujoco = import_module("mujoco")
    for _ in range(round(seconds / model.opt.timestep)):
        if targets is not None:
            data.ctrl[:] = targets(data.time + model.opt.timestep)
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)


@contextmanager
def running(page: Any) -> Iterator[Any]:
    """A page of the viewer, which stops in the end."""
    try:
        yield page
    finally:
        page.stop()


def run_python(code: str, *, timeout: float = 60, **variables: str) -> str:
    """What a fresh interpreter prints; fails when the interpreter does."""
    result = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
        env={**os.environ, **variables},
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


NUMBER = re.compile(r"-?\d[\d,]*\.?\d*(?:e-?\d+)?")


def check_rows(printed: str, page: str) -> None:
    """Every row of a Markdown table that a command prints is in the page: the same words, numbers within a tenth.

    Round-off decides about the last digit of figures with two digits, and of largest values over chattering joints.
    The first cell identifies a row.
    """
    head, _, *rows = printed.strip().splitlines()
    assert rows
    table = {line.split("|")[1]: line for line in page[page.index(head) :].split("\n\n")[0].splitlines()}
    for row in rows:
        expected = table[row.split("|")[1]]
        assert NUMBER.sub("#", row) == NUMBER.sub("#", expected)
        values = ([float(text.replace(",", "")) for text in NUMBER.findall(line)] for line in (row, expected))
        np.testing.assert_allclose(*values, rtol=0.1, err_msg=f"{row}\n{expected}")
