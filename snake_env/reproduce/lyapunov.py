"""Theorem 6.1 inside its domain: the terms of its proof for a gait that is slow enough, and V along its solutions.

V = 1/2 w^T M11 w (T 6.65) of the velocities w that no actuator drives obeys, once the joints follow their references,

    V' <= -k6 |w|^2 + k5 |w|  (T 6.114),

so V falls where |w| >= mu = k5 / (eta k6) (T 6.118), by at least W = (1 - eta) k6 |w|^2 (T 6.115), and ends below
|w| = mu sqrt(lambda_max / lambda_min) of M11 (T A.6). The norm mixes m/s and rad/s, as in the thesis.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env import minimal
from snake_env.config import Gait, IOLinearizing
from snake_env.minimal import GROUND, TABLE_7_2_GROUND, ControlPlant
from snake_env.reproduce import theorem
from snake_env.reproduce.experiment import AIKO, DEFAULT, Experiment
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]

SHARE = 0.5
"""Rate of the slow gait, over what the proof allows; also eta of (T 6.115)."""
POSTURES = 50
"""Times in a period at which suprema are taken."""
START = (2.0, 2.0, 4.0)
"""w from which V is followed [m/s, m/s, rad/s]."""
DURATION = 0.9
"""How long it is followed [s]."""


class Constants(NamedTuple):
    """Constants of the proof for one gait.

    Attributes:
        k5: bound on the sum of |k_1| to |k_4| (T 6.110).
        coulomb: the part of |k_4|, Coulomb friction, in it.
        k6: of (T 6.113).
        mu: of (T 6.118).
        ultimate: bound on |w| in the end (T A.6).
    """

    k5: float
    coulomb: float
    k6: float
    mu: float
    ultimate: float


def experiments() -> dict[str, Experiment]:
    """One period of the slow gait under input-output linearisation, on the smooth plant."""
    gait = slow_gait()
    period = 2.0 * np.pi / gait.omega
    run = Experiment(GROUND, period, gait, model="minimal", controller=IOLinearizing(), sample=period / 400)
    return {"IO, slow": dataclasses.replace(run, printed=DEFAULT)}


@cache
def slow_gait() -> Gait:
    """The gait (7.3) at half the rate that the proof allows."""
    gait = Gait()
    allowed = theorem.bound(gait).rate
    return dataclasses.replace(gait, omega=SHARE * gait.omega * allowed / theorem.reference_speed(gait))


@cache
def constants() -> Constants:
    """For the slow gait, over its postures."""
    gait = slow_gait()
    known = theorem.bound(gait)
    k6 = known.damping - known.coupling * 2.0 * theorem.reference_speed(gait)
    terms, inertia = [], []
    for time in np.linspace(0.0, 2.0 * np.pi / gait.omega, POSTURES):
        phi, rate, acceleration = _reference(gait, float(time))
        plant = minimal.control_plant(phi, np.concatenate([np.zeros(3), rate]))
        driving = (plant.M12 @ acceleration, plant.C[:3, 3:] @ rate, plant.M_V[:3, 3:] @ rate)
        terms.append([sum(float(np.linalg.norm(term)) for term in driving), _largest_coulomb(phi, plant)])
        inertia.append(np.linalg.eigvalsh(plant.M11)[[0, -1]])
    k5, coulomb = float(np.sum(terms, axis=1).max()), float(np.max(terms, axis=0)[1])
    mu = k5 / (SHARE * k6)
    spread = float(np.sqrt(np.max(inertia) / np.min(inertia)))
    return Constants(k5, coulomb, k6, mu, mu * spread)


def _largest_coulomb(phi: Array, plant: ControlPlant) -> float:
    """Bound on |k_4| (T 6.107) at a posture: no component of (T 6.21) exceeds mu_C F_N / 2."""
    heading = np.concatenate([[0.0], np.cumsum(phi)])
    along = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    load = 0.5 * np.mean(AIKO.mass) * AIKO.gravity
    total = 0.0
    for jacobian in (plant.J_F, plant.J_R):
        for axis, coefficient in zip((along, across), TABLE_7_2_GROUND.friction, strict=True):
            arms = np.einsum("ik,ikj->ij", axis, jacobian[:, :, :3])
            total += float(coefficient * load * np.linalg.norm(arms, axis=1).sum())
    return total


def energy(time: float, w: Array) -> float:
    """V (T 6.65) while the joints are at their references."""
    phi, rate, _ = _reference(slow_gait(), time)
    return float(0.5 * w @ minimal.control_plant(phi, np.concatenate([w, rate])).M11 @ w)


def energy_rate(time: float, w: Array) -> float:
    """V' (T 6.85), (T 6.95): the part of h_1 that is quadratic in w cancels half of the change of M11."""
    phi, rate, acceleration = _reference(slow_gait(), time)
    plant = minimal.control_plant(phi, np.concatenate([w, rate]))
    return float(w @ (plant.g[:3] - plant.M12 @ acceleration - plant.C[:3, 3:] @ rate))


def acceleration(time: float, w: Array) -> Array:
    """Of w in the tracking dynamics (T 6.50)."""
    phi, rate, asked = _reference(slow_gait(), time)
    plant = minimal.control_plant(phi, np.concatenate([w, rate]))
    return np.asarray(np.linalg.solve(plant.M11, plant.g[:3] - plant.M12 @ asked - plant.h[:3]), np.float64)


@cache
def decay() -> tuple[Array, Array, Array]:
    """Times (T,), |w| (T,) and V (T,) from ``START`` on."""
    times, w = solution(np.array(START), DURATION)
    return times, _norm(w), np.array([energy(*sample) for sample in zip(times, w, strict=True)])


def speed(run: Trajectory) -> Array:
    """|w| (T,)."""
    assert run.passive_velocity is not None, "a run of the minimal model"
    return _norm(run.passive_velocity)


def random_rates(norms: tuple[float, ...], count: int, seed: int = 0) -> Array:
    """V' / |w|^2 at random times and directions of w, for each norm of w (len(norms), count) [1/s]."""
    random = np.random.default_rng(seed)
    period = 2.0 * np.pi / slow_gait().omega
    rates = np.empty((len(norms), count))
    for k, norm in enumerate(norms):
        for sample in range(count):
            w = random.normal(size=3)
            w *= norm / np.linalg.norm(w)
            rates[k, sample] = energy_rate(random.uniform(0.0, period), w) / norm**2
    return rates


def solution(w: Array, duration: float, step: float = 6e-4) -> tuple[Array, Array]:
    """Times (T,) and w (T, 3) from ``w`` on, by the classical Runge-Kutta method.

    The smooth friction at rest decays with up to 4000 1/s, which bounds the step.
    """
    found = [np.asarray(w, np.float64)]
    times = np.arange(0.0, duration, step)
    for time in times[:-1]:
        now = found[-1]
        one = acceleration(time, now)
        two = acceleration(time + 0.5 * step, now + 0.5 * step * one)
        three = acceleration(time + 0.5 * step, now + 0.5 * step * two)
        four = acceleration(time + step, now + step * three)
        found.append(now + step / 6.0 * (one + 2.0 * two + 2.0 * three + four))
    return times, np.array(found)


def _reference(gait: Gait, time: float) -> tuple[Array, Array, Array]:
    """Angles, rates and accelerations of the joints at one time, (n - 1,) each."""
    wave = gait.reference(np.array([time]), theorem.JOINTS)
    return wave["angle"][0], wave["rate"][0], wave["acceleration"][0]


def _norm(w: Array) -> Array:
    return np.asarray(np.linalg.norm(w, axis=1), np.float64)
