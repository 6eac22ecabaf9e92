"""CGs off the middle of their links: what a user sees of them, and what refuses them."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, Gait, Integrator, IOLinearizing, Robot, Scene, Start, simulate
from snake_env.viewer.frames import Frames

OFFSET = [0.05, -0.04, 0.0, 0.03, -0.02, 0.01, 0.04]
ROBOT = Robot(links=7, cg_offset=OFFSET)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_positions_are_those_of_cgs_and_joints_stay_at_the_ends(model):
    run = simulate(model, robot=ROBOT, gait=Gait.lateral_undulation(), duration=1.0, start=Start(position=(0.3, 0.2)))
    np.testing.assert_allclose(run.position[0, 0, :2], (0.3, 0.2), atol=1e-12)
    assert run.unconverged.sum() == 0
    assert run.max_joint_gap < 1e-12
    middle = Frames.of_trajectory(run).position[..., :2]
    if model == "planar":
        along = np.stack([np.cos(run.angle), np.sin(run.angle)], axis=-1)
        np.testing.assert_allclose(middle, run.position + np.array(OFFSET)[:, None] * along, atol=1e-15)
        rear, front = (middle + side * 0.061 * along for side in (1.0, -1.0))
        np.testing.assert_allclose(rear[:, :-1], front[:, 1:], atol=1e-12)


@pytest.mark.parametrize("env_id", ["SnakeField-v1", "SnakeSpatial-v1"])
def test_environments_know_the_middles_of_links(env_id):
    envs = gym.make_vec(env_id, num_envs=2, robot=ROBOT)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(6):
        envs.step(envs.action_space.sample())
    state = envs.unwrapped.state()
    np.testing.assert_array_equal(state.link_cg_offset, OFFSET)
    rear, front = (state.link_middle + side * 0.061 * state.link_axis for side in (1.0, -1.0))
    np.testing.assert_allclose(rear[:, :-1], front[:, 1:], atol=1e-12)


def test_linearised_joints_move_alike_whatever_the_robot():
    """Torques that linearise the joints exactly give them the same motion, even with gains too weak to help."""

    def angles(offset):
        return simulate(
            robot=Robot(links=7, cg_offset=offset, self_contact=False),
            gait=Gait.lateral_undulation(soft_start=True),
            controller=IOLinearizing(kp=1.0, kd=1.0),
            scene=Scene(friction=(0.0, 0.0)),
            duration=1.0,
            integrator=Integrator(step=1e-3),
        ).joint_angle

    plain = angles(0.0)
    assert np.ptp(plain) > 0.3
    np.testing.assert_allclose(angles(OFFSET), plain, atol=1e-5)


def test_methods_and_models_without_it_refuse_it():
    for options in ({"model": "minimal"}, {"integrator": Integrator(method="thesis")}):
        with pytest.raises(
            ConfigError, match=r"robot\.cg_offset = 0\.01: .*needs model=\"planar\" or model=\"spatial\""
        ):
            simulate(robot=Robot(cg_offset=0.01), duration=0.1, **options)
