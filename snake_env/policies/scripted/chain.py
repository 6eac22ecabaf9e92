"""Chains of straight pieces as long as a link: bodies, and tracks ahead of them, among round pegs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from snake_env.policies.scripted.sensors import Array


@dataclass(frozen=True)
class Link:
    """Measures of a link [m].

    Args:
        length: between joints.
        half: from the link's middle to either end of its straight flanks.
        radius: half a width.
    """

    length: float
    half: float
    radius: float

    @classmethod
    def of(cls, layout: dict[str, Any]) -> Link:
        """Those of an environment's robot, whose links are alike."""
        robot = layout["config"]["robot"]
        return cls(robot["length"], robot["contact_half_length"], robot["radius"])


def unit(angle: Array) -> Array:
    """Unit vectors (2, ...) in a direction (...) [rad]."""
    return np.stack([np.cos(angle), np.sin(angle)])


def middles(direction: Array, length: float) -> Array:
    """Middles of the links (2, links, ...) [m] of a body whose leading link has its middle at the origin.

    Args:
        direction: forward, of each link (links, ...) [rad].
        length: of a link [m].
    """
    along = unit(direction)
    steps = -0.5 * length * (along[:, 1:] + along[:, :-1])
    return np.concatenate([np.zeros_like(along[:, :1]), np.cumsum(steps, axis=1)], axis=1)


class Touch(NamedTuple):
    """Where a link and a peg come nearest.

    Attributes:
        gap: between them (...) [m].
        point: of the link's centre line (2, ...) [m].
        out: unit vector away from the peg (2, ...).
    """

    gap: Array
    point: Array
    out: Array


def gaps(middle: Array, along: Array, pegs: Array, link: Link) -> Array:
    """Only the gaps of :func:`touch` (...) [m]."""
    return _nearest(middle, along, pegs, link)[0] - pegs[2] - link.radius


def touch(middle: Array, along: Array, pegs: Array, link: Link) -> Touch:
    """Where links and pegs come nearest; all arrays of the same number of dimensions.

    Args:
        middle: of a link (2, ...) [m].
        along: unit vector forward (2, ...).
        pegs: centre and radius (3, ...) [m].
        link: measures of the links.
    """
    distance, x, y, reach = _nearest(middle, along, pegs, link)
    out = np.stack([x, y]) / np.maximum(distance, 1e-9)
    return Touch(distance - pegs[2] - link.radius, middle + reach * along, out)


def _nearest(middle: Array, along: Array, pegs: Array, link: Link) -> tuple[Array, Array, Array, Array]:
    """Distance (...) and vector (x, y) from a peg's centre to the nearest point of a link, and its place along it."""
    x, y = middle[0] - pegs[0], middle[1] - pegs[1]
    reach = np.clip(-(x * along[0] + y * along[1]), -link.half, link.half)
    x, y = x + reach * along[0], y + reach * along[1]
    return np.sqrt(x * x + y * y), x, y, reach


def shifted(turns: Array, shift: Array, joints: int) -> Array:
    """Joint angles (n, joints) [rad] of bodies that have moved along their tracks.

    A body that has moved by a whole number of pieces lies on the track, link by link; between, angles change linearly,
    which is what chords of the track do but for terms of third order.

    Args:
        turns: of the track, from its far end to the tail (n, m) [rad]; the last ``joints`` are the body's at shift 0.
        shift: pieces by which the body has moved (n,), from zero to m - joints; beyond, it stays.
        joints: of the body.
    """
    ahead = turns.shape[1] - joints
    place = np.clip(ahead - shift, 0.0, ahead)[:, None] + np.arange(joints)
    whole = np.minimum(place.astype(np.int64), turns.shape[1] - 2)
    part, rows = place - whole, np.arange(len(turns))[:, None]
    return (1.0 - part) * turns[rows, whole] + part * turns[rows, whole + 1]
