"""Follow the leader: the head takes a track through pegs that push, the body follows link by link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snake_env.policies.gaits import DEGREE
from snake_env.policies.scripted.chain import Link, middles, shifted
from snake_env.policies.scripted.gaits import FILTER_DELAY, HeadingGait
from snake_env.policies.scripted.planner import DEPTH, Planner, Wishes
from snake_env.policies.scripted.sensors import Array


class FollowTheLeader(HeadingGait):
    """The head takes a track through the pegs it sees on which they can push the whole body, which follows it.

    Hirose (*Biologically Inspired Robots*, 1993) has the body of a snake follow the track of its head; Liljebaeck,
    Pettersen, Stavdahl and Gravdahl (*Experimental investigation of obstacle-aided locomotion with a snake robot*,
    IEEE Transactions on Robotics 27, 2011) have bends travel to the tail through pegs. Here the track is planned: as
    soon as the body has moved on by a share of a link, the next ten links of way are laid anew from where the robot
    is, so that errors do not add up, and steering is part of the plan. Where pegs cannot push the body on any such
    track, the bends of a wave that keeps the heading travel from the head to the tail instead.
    """

    title = "follow the leader"
    mode = "joints"
    ranges: ClassVar = {
        "speed": (0.2, 0.3),
        "bend": (50 * DEGREE, 50 * DEGREE),
        "slack": (0.03, 0.045),
        "grip": (10.0, 10.0),
        "straight": (1.0, 1.0),
        "trust": (0.2, 0.3),
        "amplitude": (45 * DEGREE, 45 * DEGREE),
        "omega": (140 * DEGREE, 140 * DEGREE),
        "beta": (-32 * DEGREE, -32 * DEGREE),
        "steering": (0.3, 0.3),
        "look_ahead": (1.0, 1.0),
    }
    """``speed``: along a planned track [m/s]; ``trust``: lack of grip, from 0 to 1, beyond which the wave takes over;
    the wave has an amplitude, omega, beta and heading control; the others are those of :class:`Wishes`."""

    def __init__(self, values: Mapping[str, Any], name: str | None = None) -> None:
        super().__init__(values, name)
        self.env_options["nearest_pegs"] = PEGS

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes."""
        self._link = Link.of(layout)
        self._moved = np.zeros(num_envs)
        self._pace = np.zeros(num_envs)
        super().begin(layout, num_envs)
        self._turns = np.zeros((num_envs, DEPTH + self.joints))

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """The robots in ``rows`` have no track yet."""
        self._moved[rows] = np.inf
        self._pace[rows] = 0.0

    def command(self) -> Array:
        """Angles of all joints, where the body is to be on its track when the references have got there."""
        self._moved = self._moved + self._pace * self.period
        rows = np.flatnonzero(self._moved >= np.maximum(REPLAN, PAUSE * self._pace))
        for start in range(0, len(rows), AT_A_TIME):
            self._lay(rows[start : start + AT_A_TIME])
        return shifted(self._turns, self._moved + self._pace * (self.period + FILTER_DELAY), self.joints)

    def _lay(self, rows: NDArray[np.int64]) -> None:
        """New tracks from the present bodies on: planned ones, or waves where pegs cannot push."""
        direction = self.sensors.link_directions[rows].T
        middle = middles(direction, self._link.length)
        wishes = Wishes(*(self[name][rows] for name in ("bend", "slack", "grip", "straight")))
        lateral = self.sensors["lateral_offset"][rows, 0] - middle[1].mean(axis=0)
        planned, lack = Planner(self._link, wishes, self.sensors.pegs[..., rows]).plan(middle, direction, lateral)
        loose = lack[-NEAR:].mean(axis=0) > self["trust"][rows]
        ahead = np.where(loose, self._wave(rows), planned)
        self._turns[rows] = np.concatenate([ahead.T, self.sensors["joint_angle"][rows]], axis=1)
        wave, track = self["omega"] / np.abs(self["beta"]), self["speed"] / self._link.length
        self._pace[rows] = np.where(loose, wave[rows], track[rows])
        self._moved[rows] = 0.0

    def _wave(self, rows: NDArray[np.int64]) -> Array:
        """Turns (DEPTH, n) of a wave that goes on from the bend at the head and keeps the heading, farthest first."""
        amplitude, beta = self["amplitude"][rows], self["beta"][rows]
        offset = self.steering_offset()[rows]
        sine, behind = (self.sensors["joint_angle"][rows, :2] - offset[:, None]).T
        phase = np.arctan2(sine, (behind - sine * np.cos(beta)) / np.sin(beta))
        pieces = np.arange(DEPTH, 0, -1)[:, None]
        return amplitude * np.sin(phase - pieces * beta) + offset


NEAR = 4
"""Pieces of a track on which it must have a grip."""

PEGS = 16
"""Pegs that it sees, the nearest to the head."""

REPLAN = 0.5
"""Progress in link lengths after which the track is planned again."""

PAUSE = 0.3
"""And at least so much later [s]."""

AT_A_TIME = 8
"""Robots whose tracks are planned together: as many as fit into caches."""
