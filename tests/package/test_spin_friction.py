"""Ground that resists the spin of planar links."""

from __future__ import annotations

import numpy as np
import pytest

from snake_env import ConfigError, Gait, Integrator, Scene, simulate

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
