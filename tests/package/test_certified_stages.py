"""What the 3D model accepts as solved: residuals follow the tolerance, what friction holds comes to rest."""

import numpy as np
import pytest

import snake_env
from snake_env import Gait, Integrator, JointTrajectory, Robot, Scene, Start
from snake_env.obstacles import Circle


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10])
def test_residuals_follow_the_tolerance(tolerance):
    scene = Scene.preset("table-7.5")
    run = snake_env.simulate(
        model="spatial",
        scene=scene,
        gait=Gait.lateral_undulation(),
        start=Start.on_course(scene),
        integrator=Integrator(step=1e-3, tolerance=tolerance),
        duration=1.0,
    )
    assert run.misses.sum() == 0
    assert run.residual.max() <= tolerance


def test_a_coil_on_a_rough_pole_comes_to_rest():
    """Wound round a pole a metre above the ground and pressed on by its joints, nearly twice as hard as it is heavy."""
    links, half_length, radius, reach = 15, 0.061, 0.1, 0.153
    posture = np.tile([2 * np.arctan(half_length / reach), 0.05], (links - 1, 1))
    run = snake_env.simulate(
        model="spatial",
        robot=Robot(links=links),
        scene=Scene(obstacles=[Circle(radius, 0.0, 0.0, friction=0.3)]),
        gait=JointTrajectory(time=[0.0, 100.0], angle=np.tile(posture + np.array([0.0135, 0.0]), (2, 1, 1))),
        start=Start(position=(0.0, -reach, 1.0), heading=0.0, posture=posture),
        duration=6.0,
        self_contact=False,
    )
    weight, pressing = run.contact_force[-1, :, 2].sum(), np.linalg.norm(run.contact_force[-1, :, :2], axis=1).sum()
    assert 1.5 < 0.3 * pressing / weight < 2.5
    assert run.misses.sum() == 0
    assert np.abs(run.position[-1] - run.position[-11]).max() < 1e-9 * (run.time[-1] - run.time[-11])
