"""Set-points of MuJoCo's servos under the actions of our environments.

The reference generator of ``rust/core/src/environment`` in NumPy: each parameter follows its target, which is constant
over a control period and limited in its rate, through a filter with a triple pole.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POLE = 30.0
"""Triple pole of the filter [1/s]; that of control periods of 50 ms and less."""


def set_points(
    entries: list[dict[str, Any]], angle: Array, actions: Array, period: float, step: float, lead: float
) -> Array:
    """``phi_d + lead phi_d'`` at the ends of the steps: (periods, steps per period, n, joints).

    With the lead kd / kp they make a servo with damping kd the PD controller (T 3.51).

    Args:
        entries: of the action of mode "gait" in the plane or "joints", as in ``layout["action"]``.
        angle: (n, joints) at rest at the start.
        actions: (periods, n, a), in [-1, 1].
        period: control period [s].
        step: of the simulation, which divides the period [s].
        lead: [s].
    """
    low, high, slew = (np.array([entry[name] for entry in entries]) for name in ("low", "high", "slew"))
    is_wave = entries[0]["name"] == "amplitude"
    value, phase = _wave_at_rest(0.5 * (low + high), angle) if is_wave else (angle, np.zeros(len(angle)))
    rate = acceleration = np.zeros_like(value)
    target = value
    t = step * np.arange(1, round(period / step) + 1)[:, None, None]
    decay = np.exp(-POLE * t)
    found = []
    for action in actions:
        desired = 0.5 * (low + high) + 0.5 * (high - low) * action
        target = np.clip(np.clip(desired, target - slew * period, target + slew * period), low, high)
        a = value - target
        b = rate + POLE * a
        c = 0.5 * (acceleration + 2.0 * POLE * b - POLE**2 * a)
        polynomial, slope = a + t * (b + t * c), b + 2.0 * t * c
        values = target + decay * polynomial
        rates = decay * (slope - POLE * polynomial)
        value, rate = values[-1], rates[-1]
        acceleration = (decay * (2.0 * c - 2.0 * POLE * slope + POLE**2 * polynomial))[-1]
        if is_wave:
            r = c / POLE
            q = (b + 2.0 * r) / POLE
            p = (a + q) / POLE
            turned = phase + (target * t + p - decay * (p + t * (q + t * r)))[..., 1]
            phase = turned[-1]
            values, rates = _wave(turned, values, rates, angle.shape[1])
        found.append(values + lead * rates)
    return np.array(found)


def _wave_at_rest(centre: Array, angle: Array) -> tuple[Array, Array]:
    """Amplitude, frequency, phase shift and offset (n, 4) in the posture of the start, and its phase (n,)."""
    amplitude, _, shift, offset = centre
    first, second = (angle[:, :2].T - offset) / amplitude
    phase = np.arctan2(first, (second - first * np.cos(shift)) / np.sin(shift))
    return np.tile([amplitude, 0.0, shift, offset], (len(angle), 1)), phase


def _wave(phase: Array, values: Array, rates: Array, joints: int) -> tuple[Array, Array]:
    """Angles and rates of the joints (..., joints) of the wave (T 2.14) with parameters and their rates (..., 4)."""
    joint = np.arange(joints)
    amplitude, frequency, shift, offset = (values[..., [k]] for k in range(4))
    amplitude_rate, _, shift_rate, offset_rate = (rates[..., [k]] for k in range(4))
    sine, cosine = np.sin(phase[..., None] + joint * shift), np.cos(phase[..., None] + joint * shift)
    angle = amplitude * sine + offset
    return angle, amplitude_rate * sine + amplitude * cosine * (frequency + joint * shift_rate) + offset_rate
