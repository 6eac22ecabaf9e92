"""The chain without inertia against closed forms and against the balance of forces, and the link on a spring."""

import math

import numpy as np
import pytest

from snake_env import Gait
from snake_env.reproduce import compliant
from snake_env.reproduce.comparison import QuasiStatic, small_amplitude_speed

DEGREE = math.pi / 180.0
STILL = Gait(amplitude=0.0)


def test_isotropic_viscous_friction_leaves_the_centre_of_gravity_where_it_is():
    """The sum of the forces is the velocity of the centre of gravity times the friction."""
    chain = QuasiStatic(Gait(), 1.0, 1.0)
    path = chain.path(4.5, 1, 80)
    np.testing.assert_allclose(path, np.broadcast_to(path[0], path.shape), atol=3e-4)


def test_a_chain_that_keeps_its_shape_does_not_move():
    for law in ("viscous", "sign", "coulomb"):
        velocity, _ = QuasiStatic(STILL, law=law).velocity(0.3, 0.1)
        assert np.abs(velocity).max() < 1e-12


@pytest.mark.parametrize("law", ["sign", "coulomb"])
def test_coulomb_forces_balance(law):
    """The forces at the velocity found, from the law itself and not from its weights."""
    chain = QuasiStatic(Gait(), law=law)
    time, heading = 0.7, 0.4
    velocity, _ = chain.velocity(time, heading)
    wave = chain.gait.reference(np.array([time]), chain.links - 1)
    theta = heading + np.concatenate([[0.0], np.cumsum(wave["angle"][0])])
    turning = velocity[2] + np.concatenate([[0.0], np.cumsum(wave["rate"][0])])
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    place, speed = np.zeros(2), velocity[:2].copy()
    force, moment = np.zeros(2), 0.0
    for i in range(chain.links):
        if i > 0:
            for j in (i - 1, i):
                place = place + 0.5 * chain.length * along[j]
                speed = speed + 0.5 * chain.length * across[j] * turning[j]
        sliding = np.array([along[i] @ speed, across[i] @ speed])
        if law == "sign":
            resistance = np.array([0.2, 0.5]) * sliding / np.hypot(sliding, 1e-5)
        else:
            resistance = np.array([0.04, 0.25]) * sliding / np.hypot(np.linalg.norm([0.2, 0.5] * sliding), 5e-6)
        push = along[i] * resistance[0] + across[i] * resistance[1]
        force += push
        moment += place[0] * push[1] - place[1] * push[0]
    assert np.abs(force).max() < 1e-4
    assert abs(moment) < 1e-4


def test_small_amplitudes_approach_resistive_force_theory_as_the_chain_grows():
    gait = Gait(amplitude=DEGREE, beta=-10 * DEGREE)
    theory = small_amplitude_speed(gait, 2.5, QuasiStatic.length)
    shares = [QuasiStatic(gait, turning=True, links=links).speed(1, 24) / theory for links in (37, 73, 145)]
    assert shares[0] < shares[1] < shares[2] < 1.0
    assert shares[2] > 0.95


def test_a_link_on_a_spring_sinks_by_its_weight_and_no_deeper_than_by_its_energy():
    stiffness = 1e5
    deepest, last = compliant.depths(stiffness, 1e-4)
    weight = compliant.MASS * 9.81
    assert last == pytest.approx(weight / stiffness, rel=1e-6)
    without_damping = weight / stiffness + math.sqrt((weight / stiffness) ** 2 + 2 * weight * 0.3 / stiffness)
    assert 0.2 * without_damping < deepest < without_damping
    assert compliant.depths(stiffness, 0.02) == (math.inf, math.inf)
