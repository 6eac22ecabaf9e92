"""Ground that resists the spin of planar links."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, Gait, Integrator, Randomization, Robot, Scene, simulate
from snake_env.testing import assert_identical

SCENE = Scene(friction=(0.1, 0.4), spin_friction=0.05)


def test_a_disc_takes_work_from_a_gait_and_a_point_none():
    point, disc = (
        simulate(scene=Scene(friction=(0.1, 0.4), spin_friction=radius), gait=Gait.lateral_undulation(), duration=4.0)
        for radius in (0.0, 0.05)
    )
    default = simulate(scene=Scene(friction=(0.1, 0.4)), gait=Gait.lateral_undulation(), duration=4.0)
    np.testing.assert_array_equal(point.position, default.position)
    assert disc.unconverged.sum() == 0
    assert disc.residual.max() < 1e-3
    assert np.abs(disc.joint_torque).mean() > 1.02 * np.abs(point.joint_torque).mean()


@pytest.mark.parametrize(
    ("options", "needs"),
    [
        ({"model": "spatial"}, "planar"),
        ({"model": "minimal"}, "planar"),
        ({"integrator": Integrator(method="thesis")}, "method="),
    ],
)
def test_others_refuse_it(options, needs):
    with pytest.raises(ConfigError, match=rf"scene\.spin_friction = 0\.05: expected 0: .*{needs}"):
        simulate(scene=SCENE, duration=0.1, **options)


def test_environments_have_it_and_continue_from_saved_states():
    envs = gym.make_vec(
        "SnakeFree-v1", num_envs=3, scene=SCENE, robot=Robot(links=7), randomization=Randomization(friction=(0.5, 1.5))
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(5):
        envs.step(envs.action_space.sample())
    saved, action = envs.unwrapped.get_state(), envs.action_space.sample()
    expected = [envs.step(action) for _ in range(8)]
    envs.unwrapped.set_state(saved)
    assert_identical([envs.step(action) for _ in range(8)], expected, "after set_state")
    assert (expected[-1][-1]["unconverged"] == 0).all()
