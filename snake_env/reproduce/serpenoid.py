"""The natural path of a gait, a serpenoid curve (T 2.13): every link follows the one before it along it.

With joint references phi_i = A sin(psi + (i - 1) beta), psi = omega t and beta < 0 (T 7.1), link i makes the
angle ``K cos(psi + (i - 3/2) beta)`` with the direction of travel, ``K = -A / (2 sin(beta / 2))``. As psi grows
by |beta|, each link takes the direction of the one before it. Without slip it takes its place too: the robot
then moves by one link length along its own body, link 1 leading.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snake_env.config import Gait

Array = NDArray[np.float64]

SAMPLES = 2048
"""Points on one wave; means over a wave are exact to round-off, as its harmonics fall off fast."""
HIGHEST_HARMONIC = 40


class NaturalPath:
    """Path of the links' CGs without slip, in the frame of travel (+x) and centre line (y = 0).

    It is exact for a chain of straight links, not only for a smooth curve: consecutive CGs are apart by
    (L/2)(e_i + e_{i+1}), a relation that is solved harmonic by harmonic.

    Args:
        gait: a wave with beta < 0 and no offset.
        length: L, distance between adjacent joints [m].
    """

    def __init__(self, gait: Gait, length: float) -> None:
        if gait.beta >= 0.0 or gait.gamma != 0.0:
            raise ValueError("gait: expected beta < 0 and gamma = 0, a wave that travels straight to the tail")
        self.beta = gait.beta
        self.omega = gait.omega
        self.swing = -gait.amplitude / (2.0 * math.sin(0.5 * gait.beta))
        self._phase: Array = np.arange(SAMPLES) * np.float64(2.0 * math.pi / SAMPLES)
        direction = np.exp(1j * self.direction(self._phase))
        self.advance_per_phase = length / -gait.beta * float(direction.real.mean())
        self._offset = _path_offset(direction, gait.beta, length)

    @property
    def crossing(self) -> float:
        """Phase psi at which link 1 crosses the centre line upwards [rad]; half a wave later downwards."""
        return 0.5 * self.beta

    @property
    def half_wave(self) -> float:
        """Distance between adjacent crossings along the direction of travel [m]."""
        return math.pi * self.advance_per_phase

    @property
    def no_slip_speed(self) -> float:
        """Largest mean forward speed of the gait [m/s], (omega L / |beta|) mean(cos(K cos psi)).

        The body moves along itself by L while psi grows by |beta|; the mean cosine, J_0(K), is the share
        of it that is forward.
        """
        return abs(self.omega) * self.advance_per_phase

    def direction(self, phase: Array | float) -> Array:
        """Angle from the direction of travel to the forward direction of link 1 [rad]."""
        return self.swing * np.cos(np.asarray(phase) - self.crossing)

    def position(self, phase: Array | float) -> Array:
        """CG of link 1 at phases psi (...) -> (..., 2) [m]; link i is where it was at psi + (i - 1) beta."""
        phases: Array = np.asarray(phase, np.float64)
        periodic = [_periodic(phases, self._phase, part) for part in (self._offset.real, self._offset.imag)]
        return np.stack([self.advance_per_phase * phases + periodic[0], periodic[1]], axis=-1)


def _path_offset(direction: NDArray[np.complex128], beta: float, length: float) -> NDArray[np.complex128]:
    """The path's periodic part z: z(psi) - z(psi + beta) = (L/2)(e(psi) + e(psi + beta)), less the mean."""
    harmonic = np.fft.fftfreq(SAMPLES, 1.0 / SAMPLES)
    turn = np.exp(1j * harmonic * beta)
    solvable = (np.abs(1.0 - turn) > 1e-6) & (np.abs(harmonic) <= HIGHEST_HARMONIC)
    factor = np.zeros(SAMPLES, np.complex128)
    factor[solvable] = 0.5 * length * (1.0 + turn[solvable]) / (1.0 - turn[solvable])
    return np.fft.ifft(factor * np.fft.fft(direction))


def _periodic(phase: Array, samples: Array, values: Array) -> Array:
    return np.interp(np.mod(phase, 2.0 * math.pi), samples, values, period=2.0 * math.pi)
