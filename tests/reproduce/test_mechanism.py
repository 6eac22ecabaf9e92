"""Gray's three links: the pegs' forces by the simulation, by statics and by Lagrange multipliers."""

import math

import numpy as np
import pytest

import snake_env
from snake_env.reproduce import mechanism
from snake_env.reproduce.mechanism import ARM, CONSTANT_TORQUE, ROBOT, TORQUE, across, peg_forces, three_links

DEGREE = math.pi / 180.0
ANGLES = [(50, 30), (30, 30), (10, 30), (40, 5)]


def multipliers(alpha, beta):
    """Forces of frictionless pegs on a robot at rest, with the links' inertia, in absolute coordinates (3, 2) [N].

    Unknowns: accelerations (x, y, theta) of three links, two joint forces, three normal forces of pegs at the CGs.
    """
    headings = np.array([alpha, 0.0, -beta])
    normal = across(headings) * np.array([[-1.0], [1.0], [-1.0]])
    constraints = []
    for front in (0, 1):
        for axis in (0, 1):
            row = np.zeros((3, 3))
            row[front, axis], row[front + 1, axis] = 1.0, -1.0
            row[front, 2] = -ARM * across(headings)[front, axis]
            row[front + 1, 2] = -ARM * across(headings)[front + 1, axis]
            constraints.append(row.ravel())
    for link in range(3):
        row = np.zeros((3, 3))
        row[link, :2] = normal[link]
        constraints.append(row.ravel())
    jacobian = np.array(constraints)
    mass = np.diag([value for _ in range(3) for value in (ROBOT.mass, ROBOT.mass, ROBOT.inertia)])
    torque = np.zeros((3, 3))
    torque[:, 2] = (TORQUE, 0.0, -TORQUE)  # bend the C further: link 1 to the left, link 3 to the right
    system = np.block([[mass, -jacobian.T], [jacobian, np.zeros((7, 7))]])
    pegs = np.linalg.solve(system, np.concatenate([torque.ravel(), np.zeros(7)]))[-3:]
    assert np.all(pegs > 0.0), "the pegs push"
    return pegs[:, None] * normal


@pytest.mark.parametrize(("alpha", "beta"), ANGLES)
def test_the_simulated_forces_are_those_of_lagrange(alpha, beta):
    scene, start = three_links(alpha * DEGREE, beta * DEGREE)
    run = snake_env.simulate(
        robot=ROBOT,
        scene=snake_env.Scene(obstacles=scene.obstacles, friction=(0.0, 0.0)),
        gait=mechanism.BEND_FURTHER,
        controller=CONSTANT_TORQUE,
        start=start,
        integrator=snake_env.Integrator(step=1e-4),
        duration=2e-4,
        sample=1e-4,
    )
    np.testing.assert_allclose(run.contact_force[1], multipliers(alpha * DEGREE, beta * DEGREE), atol=0.02)


def test_without_inertia_statics_remains():
    """Equal angles: nothing accelerates, and the three ways agree exactly."""
    np.testing.assert_allclose(multipliers(0.5, 0.5), peg_forces(0.5, 0.5), atol=1e-9)


@pytest.mark.parametrize(("alpha", "beta"), ANGLES)
def test_statics_balances_moments_about_the_joints_and_forces_across_the_middle_link(alpha, beta):
    forces = peg_forces(alpha * DEGREE, beta * DEGREE)
    np.testing.assert_allclose(np.linalg.norm(forces[[0, 2]], axis=1) * ARM, TORQUE)
    assert forces[:, 1].sum() == pytest.approx(0.0, abs=1e-9)
    assert np.sign(round(forces[:, 0].sum(), 9)) == np.sign(alpha - beta)


def test_three_pegs_touch_the_three_links():
    scene, start = three_links(40 * DEGREE, 20 * DEGREE)
    run = snake_env.simulate(robot=ROBOT, scene=scene, start=start, duration=1e-3, sample=1e-3)
    distance = np.linalg.norm(np.array(scene.obstacles)[:, 1:] - run.position[0], axis=1)
    np.testing.assert_allclose(distance, ROBOT.radius + scene.obstacles[0][0], atol=1e-12)
    assert run.max_penetration < 1e-6
