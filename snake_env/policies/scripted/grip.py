"""Whether pegs can push a body forward along its own curve: the balance of their forces against friction.

A body that follows its head's track slides along its links, so that friction of a known size pulls each link back
along its direction. Pegs, which are smooth, push across the links that they touch and never pull. The motion goes on
without slip if such forces can balance friction in both directions and about the vertical axis (section 5.5 of the
thesis: three push-points for three equations).
"""

from __future__ import annotations

import numpy as np

from snake_env.policies.scripted.sensors import Array

ARM = 0.4
"""Length by which moments are compared with forces [m]; about the radius of gyration of a body of 1.34 m."""

ITERATIONS = 12
"""Of the solver; the costs of tracks are compared after so many, be they exact or not."""

STIFFNESS = 0.02
"""Share of a force's square that counts as imbalance: keeps forces, in units of all friction, from growing large."""


def shortfall(friction: Array, pushes: Array) -> Array:
    """Share of friction that pushes of the pegs cannot balance (...), from 0, they can, to 1, they cannot help at all.

    Accelerated projected gradient for min |friction + sum_k f_k push_k|^2 + STIFFNESS sum_k f_k^2 over f >= 0.

    Args:
        friction: its wrench (3, ...).
        pushes: wrench of a unit push at each contact (3, k, ...); zeros where there is none.
    """
    x, y, moment = pushes
    step = 1.0 / ((pushes**2).sum(axis=(0, 1)) + STIFFNESS)
    force = ahead = np.zeros(np.broadcast_shapes(x.shape, friction.shape[1:]))
    for k in range(ITERATIONS):
        left = _left(friction, pushes, ahead)
        slope = x * left[0] + y * left[1] + moment * left[2] + STIFFNESS * ahead
        new = np.maximum(ahead - step * slope, 0.0)
        ahead = new + k / (k + 3.0) * (new - force)
        force = new
    least = (_left(friction, pushes, force) ** 2).sum(axis=0) + STIFFNESS * (force**2).sum(axis=0)
    return np.sqrt(np.minimum(least / (friction**2).sum(axis=0), 1.0))


def _left(friction: Array, pushes: Array, force: Array) -> Array:
    """What is left of friction (3, ...) when contacts push with ``force`` (k, ...)."""
    return np.stack([friction[i] + (pushes[i] * force).sum(axis=0) for i in range(3)])


def wrench(point: Array, force: Array) -> Array:
    """Force and moment about the origin over :data:`ARM` (3, ...) of a force (2, ...) at a point (2, ...)."""
    return np.stack([force[0], force[1], (point[0] * force[1] - point[1] * force[0]) / ARM])


def moved(wrench: Array, centre: Array) -> Array:
    """A wrench (3, ...) about another point ``centre`` (2, ...) [m] than the origin."""
    moment = wrench[2] - (centre[0] * wrench[1] - centre[1] * wrench[0]) / ARM
    return np.stack([wrench[0], wrench[1], moment])
