"""Robots that hold and move themselves by friction: on a pole, in a pipe and over uneven ground."""

import gymnasium
import numpy as np
import pytest

import snake_env


def run(env_id, action, steps, **keywords):
    """Distances (steps, 2) of two robots whose every action is the given one, and the environment after that."""
    envs = gymnasium.make_vec(env_id, num_envs=2, **keywords)
    envs.reset(seed=0)
    distances = []
    for _ in range(steps):
        *_, info = envs.step(np.broadcast_to(action, envs.action_space.shape).astype(np.float32))
        assert not info["unconverged"].any()
        assert not info["penetrated"].any()
        distances.append(info["distance"])
    return np.array(distances), envs


def test_a_helix_that_rolls_climbs_a_pole():
    distances, envs = run("SnakeClimb-v1", 0.0, 120)
    assert (distances[-1] > 0.1).all()
    assert envs.unwrapped.scene(0).slope[0] == np.pi / 2, "gravity points along -x"


def test_a_helix_that_does_not_roll_stays_on_the_pole_at_rest():
    entries = gymnasium.make("SnakeClimb-v1").unwrapped.layout["action"]
    still = {entry["name"]: -(entry["high"] + entry["low"]) / (entry["high"] - entry["low"]) for entry in entries}
    action = np.array([still[entry["name"]] if entry["name"] == "frequency" else 0.0 for entry in entries])
    _, envs = run("SnakeClimb-v1", action, 80)
    speed = np.abs(envs.unwrapped.state().link_velocity[..., :3]).max()
    assert speed < 1e-6


def test_a_helix_that_rolls_moves_through_a_pipe():
    distances, _ = run("SnakePipe-v1", 0.0, 120)
    assert (distances[-1] > 0.05).all()


@pytest.mark.parametrize("terrain", ["rough", "blocks", "stairs", "ramps"])
def test_sidewinding_crosses_uneven_ground(terrain):
    distances, envs = run("SnakeTerrain-v1", 0.0, 100, terrain=terrain, difficulty=1.0)
    assert (distances[-1] > 0.1).all()
    (field,) = envs.unwrapped.scene(0).obstacles
    assert isinstance(field, snake_env.obstacles.HeightField)
    assert np.ptp(field.height) > 0.03


@pytest.mark.parametrize("task", ["climb", "pipe"])
def test_a_helix_needs_cardan_joints_and_enough_links(task):
    for robot in (snake_env.Robot(links=5), snake_env.Robot(axes="yaw")):
        with pytest.raises(snake_env.ConfigError, match=f'cardan joints for the task "{task}"'):
            gymnasium.make_vec("SnakeSpatial-v1", num_envs=1, task=task, robot=robot)
    with pytest.raises(snake_env.ConfigError, match="model"):
        gymnasium.make_vec("SnakeFree-v1", num_envs=1, task=task)
