"""SnakeClutter-v1: a way through discs and boxes that can be pushed."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

from snake_env import SnakeVectorEnv, evaluate
from snake_env.obstacles import Box, Circle


def radius(obstacle):
    """Of the disc, or of the circle around the box [m]."""
    return obstacle.radius if isinstance(obstacle, Circle) else np.hypot(*obstacle.size) / 2


def test_difficulty_orders_number_and_masses():
    for difficulty, count, heaviest in ((0.0, 6, 0.076), (1.0, 40, 75.0)):
        with closing(SnakeVectorEnv(40, task="clutter", difficulty=difficulty)) as envs:
            envs.reset(seed=0)
            scenes = [envs.scene(i).obstacles for i in range(40)]
            state = envs.state()
            links = state.link_position
        numbers = [len(scene) for scene in scenes]
        assert 0.8 * count <= np.mean(numbers) <= count
        masses = np.array([one.mass for scene in scenes for one in scene])
        assert masses.min() >= 0.0749
        assert 0.7 * heaviest < masses.max() <= heaviest
        boxes = [one for scene in scenes for one in scene if isinstance(one, Box)]
        assert 0.4 < len(boxes) / len(masses) < 0.6
        slimness = np.array([max(box.size) / min(box.size) for box in boxes])
        assert slimness.min() < 1.2 < 2.2 < slimness.max() < 2.42
        for scene, robot in zip(scenes, links, strict=True):
            centres = np.array([(one.x, one.y) for one in scene])
            radii = np.array([radius(one) for one in scene])
            apart = np.linalg.norm(centres[:, None] - centres[None], axis=2) - radii[:, None] - radii
            assert (apart + np.eye(len(scene)) > 0.0).all()
            # The robot passes between those that it can hardly push, as far as it does not start there.
            heavy = np.array([one.mass * one.ground_friction > 0.3 * 7.5 for one in scene])
            assert apart[heavy][:, heavy][~np.eye(heavy.sum(), dtype=bool)].min(initial=1.0) > 0.12
            assert (np.linalg.norm(robot[:, None] - centres, axis=2) > radii + 0.0525).all()


def test_heading_control_pushes_light_discs_out_of_the_way():
    easy = evaluate("heading-control", task="SnakeClutter-v1", episodes=16, seed=0)
    with closing(SnakeVectorEnv(16, task="clutter", difficulty=0.0)) as envs:
        envs.reset(seed=0)
        before = envs.state().obstacle_position
        for _ in range(200):
            envs.step(np.zeros(envs.action_space.shape, np.float32))
        moved = np.linalg.norm(envs.state().obstacle_position - before, axis=2)
    assert (np.nanmax(moved, axis=1) > 0.02).sum() > 6
    assert easy is not None


@pytest.mark.parametrize(("model", "robots", "periods"), [("planar", 32, 150), ("spatial", 8, 60)])
def test_random_actions_leave_no_overlap_and_no_solve_unreported(model, robots, periods):
    with closing(SnakeVectorEnv(robots, model=model, task="clutter", difficulty=1.0, num_threads=1)) as envs:
        rng = np.random.default_rng(0)
        envs.reset(seed=0)
        before = envs.state().obstacle_position
        unconverged = flagged = 0
        for _ in range(periods):
            info = envs.step(rng.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32))[4]
            unconverged += int(np.sum(info["unconverged"]))
            flagged += int(np.sum(info["penetrated"]))
            assert not np.any(info["diverged"])
            solved = info["unconverged"] == 0
            assert np.all(info["residual"][solved] < 1e-3)
        assert unconverged <= 2
        assert flagged <= 2
        state = envs.state()
        assert np.isfinite(state.link_position).all()
        assert np.nanmax(np.linalg.norm(state.obstacle_position - before, axis=2)) > 0.02
