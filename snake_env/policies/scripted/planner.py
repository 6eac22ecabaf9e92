"""Tracks through known pegs that hold the whole body in their grip: a beam search over turns from link to link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snake_env.policies.scripted import grip
from snake_env.policies.scripted.chain import Link, gaps, touch, unit
from snake_env.policies.scripted.sensors import Array

DEPTH = 10
"""Pieces that a track has ahead of the head: most of what the robot sees."""

BEAM = 24
"""Tracks that are kept at each length."""

CLEARANCE = 0.003
"""A track may press into a peg by so much [m]."""

PRESSED = 0.01
"""Penetration of a peg that costs as much as a piece of track [m]."""

FORWARD = 1.2
"""Pieces may point so far to either side of the goal direction [rad]."""

BACKWARD = 0.1
"""Deviation of the heading that costs as much as a piece of track [rad]."""

LEVELS = np.linspace(-1.0, 1.0, 9)
"""Turns that the search tries, in parts of the largest."""


@dataclass(frozen=True)
class Wishes:
    """What a track should be like: one number per robot (n,).

    Args:
        bend: largest turn from piece to piece [rad].
        slack: gap beyond which a peg does not push [m].
        grip: cost of a piece on which pegs cannot push at all, in pieces of track.
        straight: cost of the square of the sideways distance from the centre line, at the end [1/m^2].
    """

    bend: Array
    slack: Array
    grip: Array
    straight: Array


@dataclass
class Beam:
    """Tracks of the same length (n, b), as the bodies that have moved to their ends; leading piece first.

    Attributes:
        middle: of the pieces under the body (2, links, n, b) [m].
        angle: directions of these pieces (links, n, b) [rad].
        slide: wrenches of unit forces forward along them (3, links, n, b).
        push: wrenches by which the peg nearest to each of them can push it (3, links, n, b).
        turns: made so far (pieces, n, b) [rad], the last first.
        lack: of grip on each piece made so far (pieces, n, b), from 0 to 1, the last first.
        cost: so far (n, b).
    """

    middle: Array
    angle: Array
    slide: Array
    push: Array
    turns: Array
    lack: Array
    cost: Array


class Planner:
    """Finds tracks.

    Args:
        link: measures of the robot's links.
        wishes: what tracks should be like.
        pegs: centres and radii (3, k, n) [m], x towards the goal.
    """

    def __init__(self, link: Link, wishes: Wishes, pegs: Array) -> None:
        self._link, self._wishes, self._pegs = link, wishes, pegs

    def plan(self, middle: Array, direction: Array, lateral: Array) -> tuple[Array, Array]:
        """The best tracks: their turns (DEPTH, n) [rad], to the right positive, and lack of grip (DEPTH, n), 0 to 1.

        The farthest piece comes first.

        Args:
            middle: of each link (2, links, n) [m].
            direction: of each link (links, n) [rad].
            lateral: where the x axis lies to the left of the centre line (n,) [m].
        """
        beam = self._present(middle, direction)
        for _ in range(DEPTH):
            beam = self._longer(beam)
        x, y = beam.middle[:, 0]
        cost = beam.cost - x / self._link.length + self._wishes.straight[:, None] * (lateral[:, None] + y) ** 2
        rows, best = np.arange(len(cost)), cost.argmin(axis=1)
        return beam.turns[:, rows, best], beam.lack[:, rows, best]

    def _present(self, middle: Array, direction: Array) -> Beam:
        """The bodies as they lie, one track of no length each."""
        along, robots = unit(direction), direction.shape[1]
        push = self._push(middle.swapaxes(1, 2)[..., None], along.swapaxes(1, 2)[..., None])[0].swapaxes(1, 2)
        slide = grip.wrench(middle, along)[..., None]
        none = np.zeros((0, robots, 1))
        return Beam(middle[..., None], direction[..., None], slide, push, none, none, np.zeros((robots, 1)))

    def _longer(self, beam: Beam) -> Beam:
        """The best tracks that are one piece longer."""
        turn = np.broadcast_to(self._wishes.bend[:, None, None] * LEVELS, (*beam.cost.shape, len(LEVELS)))
        angle = beam.angle[0, ..., None] - turn
        before, along = unit(beam.angle[0, ..., None]), unit(angle)
        middle = beam.middle[:, 0, ..., None] + 0.5 * self._link.length * (before + along)
        slide = grip.wrench(middle, along)
        push, gap = self._push(middle, along)
        lack = self._lack(beam, slide, push)
        astray = np.maximum(-CLEARANCE - gap, 0.0) / PRESSED + np.maximum(np.abs(angle) - FORWARD, 0.0) / BACKWARD
        cost = beam.cost[..., None] + astray + self._wishes.grip[:, None, None] * lack
        ranked = (cost - middle[0] / self._link.length).reshape(len(cost), -1)
        kept = np.argsort(ranked, axis=1, kind="stable")[:, :BEAM]
        return _extended(beam, kept, Beam(middle, angle, slide, push, turn, lack, cost))

    def _push(self, middle: Array, along: Array) -> tuple[Array, Array]:
        """Wrenches by which the nearest pegs push pieces (3, ...), the less the wider the gap, and gaps (...) [m]."""
        gap = gaps(middle[:, None], along[:, None], self._pegs[..., None, None], self._link)
        nearest, rows = gap.argmin(axis=0), np.arange(len(gap[0]))[:, None, None]
        found = touch(middle, along, self._pegs[:, nearest, rows], self._link)
        share = np.clip(1.0 - found.gap / self._wishes.slack[:, None, None], 0.0, 1.0)
        return share * grip.wrench(found.point, found.out), found.gap

    def _lack(self, beam: Beam, slide: Array, push: Array) -> Array:
        """How far pegs cannot push bodies forward (n, b, levels) that are led by new pieces."""
        links = len(beam.angle)
        centre = beam.middle.mean(axis=1)
        friction = -(beam.slide[:, :-1].sum(axis=1)[..., None] + slide) / links
        old = np.broadcast_to(beam.push[:, :-1, ..., None], (3, links - 1, *push.shape[1:]))
        pushes = np.concatenate([push[:, None], old], axis=1)
        return grip.shortfall(grip.moved(friction, centre[..., None]), grip.moved(pushes, centre[:, None, ..., None]))


def _extended(beam: Beam, kept: NDArray[np.int64], new: Beam) -> Beam:
    """Those tracks (n, b') that are ``kept`` of the longer ones (n, b, levels) that ``new`` pieces make."""
    rows = np.arange(len(kept))[:, None]
    parent, level = np.divmod(kept, len(LEVELS))

    def longer(piece: Array, old: Array) -> Array:
        first = piece[..., rows, parent, level]
        return np.concatenate([np.expand_dims(first, -3), old[..., rows, parent]], axis=-3)

    return Beam(
        longer(new.middle, beam.middle[:, :-1]),
        longer(new.angle, beam.angle[:-1]),
        longer(new.slide, beam.slide[:, :-1]),
        longer(new.push, beam.push[:, :-1]),
        longer(new.turns, beam.turns),
        longer(new.lack, beam.lack),
        new.cost[rows, parent, level],
    )
