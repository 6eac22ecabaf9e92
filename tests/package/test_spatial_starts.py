"""Starts of the user's own in environments of the 3D model: raised, tilted, bent up and down."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Gait, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start

SPATIAL = {"model": "spatial", "task": "free"}
RAISED = Start(position=(0.0, 0.0, 0.35), pitch=0.5, posture="straight")
PAIRS = [(0.1, 0.2 * (-1) ** joint) for joint in range(10)]


@pytest.mark.parametrize(
    "start",
    [
        RAISED,
        Start(position=(0.2, 0.1), heading=1.0, pitch=0.3, roll=0.4, posture=PAIRS),
        Start(position=(0.2, 0.1), heading=2.0, roll=math.pi / 2, posture="straight"),
        Start(position=(0.2, 0.1), heading=2.0, posture=[0.3] * 10),
    ],
)
def test_a_robot_starts_where_a_scripted_run_does(start):
    env = SnakeEnv(start=start, **SPATIAL)
    env.reset(seed=0)
    state, run = env.state(), snake_env.simulate("spatial", gait=Gait(soft_start=True), start=start, duration=0.1)
    np.testing.assert_allclose(state.link_position, run.position[0], atol=1e-12)
    np.testing.assert_allclose(state.link_quaternion, run.quaternion[0], atol=1e-12)
    np.testing.assert_allclose(state.joint_angle, run.joint_angle[0], atol=1e-12)


def test_a_dropped_robot_falls_freely_and_comes_to_rest_on_the_ground():
    env = SnakeEnv(start=Start(position=(0.0, 0.0, 0.55), posture="straight"), action_mode="joints", **SPATIAL)
    env.reset(seed=0)
    for _ in range(4):
        env.step(np.zeros(20))
    fallen = 0.55 - env.state().link_position[:, 2]
    np.testing.assert_allclose(fallen, 0.5 * 9.81 * 0.2**2, rtol=0.03)
    for _ in range(20):
        env.step(np.zeros(20))
    np.testing.assert_allclose(env.state().link_position[:, 2], Robot().radius, atol=1e-4)


def test_references_of_the_joints_hold_the_posture_of_the_start():
    env = SnakeEnv(start=Start(posture=PAIRS), action_mode="joints", **SPATIAL)
    observation, _ = env.reset(seed=0)
    block = next(block for block in env.layout["observation"] if block["name"] == "reference")
    held = observation[block["start"] : block["start"] + block["size"]] * block["scale"]
    np.testing.assert_allclose(held.reshape(10, 2), PAIRS, atol=1e-6)


def test_room_is_measured_where_the_robot_is():
    """Upright on its leading link, a robot takes no room where it would lie."""
    scene = Scene(obstacles=[(0.05, -0.6, 0.0)])
    lying = {"heading": math.pi, "posture": "straight"}
    SnakeEnv(scene=scene, start=Start(pitch=math.pi / 2, **lying), **SPATIAL).reset(seed=0)
    with pytest.raises(ConfigError, match=r"^scene\.obstacles\[0\] = "):
        SnakeEnv(scene=scene, start=Start(heading=0.0, posture="straight", position=(-1.0, 0.0)), **SPATIAL)


def test_a_reset_raises_some_robots_once():
    env = SnakeVectorEnv(2, **SPATIAL)
    env.reset(seed=0, options={"start": [None, RAISED]})
    heights = env.state().link_position[:, 0, 2]
    assert heights[0] < 0.06
    assert heights[1] == pytest.approx(0.35)
    env.reset()
    assert (env.state().link_position[:, 0, 2] < 0.06).all()


@pytest.mark.parametrize(
    ("start", "field"),
    [
        ({"position": (0.0, 0.0, 0.01)}, r"start\.position\[2\]"),
        ({"position": (0.0, 0.0, math.nan)}, r"start\.position\[2\]"),
        ({"position": (0.0,)}, r"start\.position"),
        ({"pitch": 2.0}, r"start\.pitch"),
        ({"roll": math.inf}, r"start\.roll"),
        ({"posture": [(0.0, 2.0)] * 10}, r"start\.posture"),
        ({"posture": "bent"}, r"start\.posture"),
    ],
)
def test_a_start_that_is_none_is_refused_by_name(start, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        SnakeEnv(start=Start(**start), **SPATIAL)
