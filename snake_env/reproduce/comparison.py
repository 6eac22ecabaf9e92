"""The models of section 2.3.2 that the thesis compares its own with, without inertia: (T 2.1), (T 2.5) to (T 2.11).

Without inertia the forces and the moment of friction on the whole robot vanish at every instant. The joints follow a
gait, so three numbers are free, the velocity of link 1 and its rate of turning. With viscous friction they solve a
linear equation, (T 2.11) with the balance of moments beside that of forces. Coulomb friction is the same with weights:
where a link slides with v, the component k along or across it resists like viscous friction with the coefficient

    mu_k / |v_k|              sign friction (T 2.8), each component by itself,
    mu_k^2 / |(mu_k v_k)|     Coulomb friction against sliding, (T 3.61) and (T 6.25), both together,

which is found by iterating (iteratively reweighted least squares). Wheels without slip (T 2.1), more constraints than
freedoms, are met in the least-squares sense by friction across the links only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from snake_env.config import PD, Gait, Robot, Scene, Start
from snake_env.reproduce.experiment import AIKO, DEFAULT, PERIOD, Experiment
from snake_env.reproduce.measures import at
from snake_env.trajectory import Trajectory

Array = NDArray[np.float64]
Law = Literal["viscous", "sign", "coulomb", "wheels"]

SLOWEST = 1e-5
"""Sliding speed below which Coulomb friction counts as viscous [m/s]."""
REPEATS = 200
"""Most iterations of a velocity."""
CONVERGED = 1e-8
"""Change of the velocities at which they end [m/s]."""
STIFF = PD(kp=2e4, kd=120.0)
"""Joints of the minimal model that follow their references within 0.01 degrees."""


def experiments() -> dict[str, Experiment]:
    """The minimal model with viscous friction (T 2.4), (T 2.7) and with a smooth form of (T 2.8).

    Two points per link at l / sqrt(3) from its CG, l half a link, resist its turning like the whole link does.
    """
    spread = 0.5 * float(np.mean(AIKO.length)) / math.sqrt(3.0)
    scenes = {
        "viscous": (Scene(friction=(0.0, 0.0), viscous=(1.0, 2.5)), Robot(contact_half_length=spread)),
        "sign": (Scene(friction=(0.2, 0.5), friction_law="arctan", smoothing=1e-4), Robot(contact_half_length=0.0)),
    }
    return {
        name: Experiment(
            scene, 2 * PERIOD, Gait(), Start(), "minimal", STIFF, robot=robot, integrator=DEFAULT, printed=DEFAULT
        )
        for name, (scene, robot) in scenes.items()
    }


def steady_speed(run: Trajectory) -> float:
    """Displacement of the centre of gravity in the second period, over its duration [m/s]."""
    centre = run.position.mean(axis=1)
    return float(np.linalg.norm(centre[at(run, 2 * PERIOD)] - centre[at(run, PERIOD)])) / PERIOD


@cache
def law_speed(law: Law) -> float:
    """Of the gait (7.3) without inertia [m/s]."""
    return QuasiStatic(Gait(), law=law, turning=law == "viscous").speed(1, 60)


@dataclass(frozen=True)
class QuasiStatic:
    """A chain of links without inertia under a gait.

    Args:
        gait: of the joints.
        along: coefficient of friction along the links; viscous or Coulomb, per unit of weight.
        across: the same across them.
        law: "viscous" (T 2.5), "sign" (T 2.8), "coulomb" (T 3.61), or "wheels" (T 2.1).
        turning: whether the turning of a link meets friction as in (T 2.7); viscous friction only.
        links: their number.
        length: distance between adjacent joints [m].
    """

    gait: Gait
    along: float = 0.2
    across: float = 0.5
    law: Law = "viscous"
    turning: bool = False
    links: int = AIKO.links
    length: float = float(np.mean(AIKO.length))

    def speed(self, periods: int = 2, steps: int = 90) -> float:
        """Displacement of the centre of gravity in the last of some periods, over its duration [m/s]."""
        period = 2.0 * math.pi / self.gait.omega
        path = self.path(period, periods, steps)
        return float(np.linalg.norm(path[-1] - path[-1 - steps])) / period

    def path(self, period: float, periods: int, steps: int) -> Array:
        """Centre of gravity (periods * steps + 1, 2) by the midpoint rule, ``steps`` per period [m]."""
        step = period / steps
        place = np.zeros(3)
        found = []
        for k in range(periods * steps + 1):
            time = k * step
            velocity, centre = self.velocity(time, place[2])
            found.append(place[:2] + centre)
            middle, _ = self.velocity(time + 0.5 * step, place[2] + 0.5 * step * velocity[2])
            place = place + step * middle
        return np.array(found)

    def velocity(self, time: float, heading: float) -> tuple[Array, Array]:
        """Velocity of link 1 (3,) [m/s, m/s, rad/s], and the centre of gravity (2,) seen from its CG [m]."""
        wave = self.gait.reference(np.array([time]), self.links - 1)
        theta = heading + np.concatenate([[0.0], np.cumsum(wave["angle"][0])])
        bending = np.concatenate([[0.0], np.cumsum(wave["rate"][0])])
        axes = np.stack([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]]).transpose(2, 0, 1)
        arm = 0.5 * self.length
        place = _along_the_chain(arm * axes[:, 0])
        relative = _along_the_chain(arm * axes[:, 1] * bending[:, None])
        # Rows: velocity of each link's CG along and across it, as functions of the velocity of link 1.
        turned = np.stack([-place[:, 1], place[:, 0]], axis=-1)
        slopes = np.concatenate([axes, np.einsum("ikc,ic->ik", axes, turned)[..., None]], axis=-1)
        offsets = np.einsum("ikc,ic->ik", axes, relative)
        return self._balance(slopes, offsets, bending), place.mean(axis=0)

    def _balance(self, slopes: Array, offsets: Array, bending: Array) -> Array:
        """The velocity of link 1 at which friction balances."""
        coefficients = np.array([0.0 if self.law == "wheels" else self.along, self.across])
        weights = np.broadcast_to(coefficients, offsets.shape)
        rows, rates = slopes.reshape(-1, 3), offsets.ravel()
        spin = self.across * self.length**2 / 12.0 if self.turning else 0.0
        velocity = np.zeros(3)
        for _ in range(REPEATS):
            weighted = rows * weights.reshape(-1, 1)
            matrix, right = weighted.T @ rows, weighted.T @ rates
            matrix[2, 2] += spin * self.links
            right[2] += spin * bending.sum()
            last, velocity = velocity, -np.linalg.solve(matrix, right)
            if self.law in ("viscous", "wheels") or np.abs(velocity - last).max() < CONVERGED:
                break
            weights = self._weights(coefficients, slopes @ velocity + offsets)
        return velocity

    def _weights(self, coefficients: Array, sliding: Array) -> Array:
        """Viscous coefficients (links, 2) that give the Coulomb friction of links that slide so."""
        if self.law == "sign":
            return np.asarray(coefficients / np.hypot(sliding, SLOWEST))
        size = np.sqrt(np.sum((coefficients * sliding) ** 2, axis=-1, keepdims=True) + (coefficients[1] * SLOWEST) ** 2)
        return np.asarray(coefficients**2 / size)


def _along_the_chain(halves: Array) -> Array:
    """What links add up to from the CG of link 1 to that of each, with ``halves`` from joint to CG (n, 2)."""
    return np.concatenate([np.zeros((1, 2)), np.cumsum(halves[:-1] + halves[1:], axis=0)])


def small_amplitude_speed(gait: Gait, ratio: float, length: float) -> float:
    """Speed of an infinite, viscous chain by resistive force theory, (K^2 / 2) V (c_n / c_t - 1) [m/s].

    K = A / (2 sin(|beta| / 2)) is the largest heading, V = omega L / |beta| the speed of the wave.
    """
    heading = gait.amplitude / (2.0 * math.sin(0.5 * abs(gait.beta)))
    return 0.5 * heading**2 * abs(gait.omega * length / gait.beta) * (ratio - 1.0)
