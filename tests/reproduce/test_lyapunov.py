"""Terms of the proof of Theorem 6.1 against differences of V along solutions, and against the simulation."""

import numpy as np
import pytest

from snake_env import Gait, IOLinearizing, minimal, simulate
from snake_env.minimal import GROUND
from snake_env.reproduce import lyapunov, theorem


def test_the_rate_of_v_is_its_derivative_along_solutions():
    w, step = np.array([0.8, -0.5, 1.5]), 1e-4
    times, found = lyapunov.solution(w, 21.5 * step, step)
    energy = np.array([lyapunov.energy(*sample) for sample in zip(times, found, strict=True)])
    rates = np.array([lyapunov.energy_rate(*sample) for sample in zip(times, found, strict=True)])
    np.testing.assert_allclose((energy[2:] - energy[:-2]) / (2.0 * step), rates[1:-1], rtol=1e-5)


def test_the_slow_gait_satisfies_the_condition_by_a_factor_of_two():
    gait = lyapunov.slow_gait()
    assert theorem.reference_speed(gait) == pytest.approx(lyapunov.SHARE * theorem.bound(Gait()).rate, rel=1e-3)
    assert lyapunov.constants().k6 == pytest.approx((1 - lyapunov.SHARE) * theorem.bound(Gait()).damping, rel=1e-3)


def test_no_state_has_more_coulomb_friction_than_the_bound_on_k_4():
    """The part of g_1 that is neither viscous nor beyond (T 6.110), at random velocities."""
    random, known = np.random.default_rng(1), lyapunov.constants()
    phi = lyapunov.slow_gait().reference(np.array([3.0]))["angle"][0]
    largest = 0.0
    for _ in range(200):
        nu = np.concatenate([random.normal(size=3), 0.02 * random.normal(size=10)])
        plant = minimal.control_plant(phi, nu)
        largest = max(largest, float(np.linalg.norm((plant.g + plant.M_V @ nu)[:3])))
    assert 0.4 * known.coulomb < largest < known.coulomb


def test_the_tracking_dynamics_are_those_of_the_simulated_plant():
    """(T 6.50) from rest, against a simulation whose joints have caught up with their references."""
    run = simulate(
        "minimal", scene=GROUND, gait=lyapunov.slow_gait(), controller=IOLinearizing(), duration=0.4, sample=0.2
    )
    times, found = lyapunov.solution(np.zeros(3), 0.4 + 1e-9)
    assert times[-1] == pytest.approx(0.4, abs=1e-3)
    np.testing.assert_allclose(found[-1], run.passive_velocity[-1], atol=1e-3 * np.linalg.norm(found[-1]))
