"""Decentralised control: every joint follows the one ahead of it and gives way to, or grips, what its links touch."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snake_env.policies.gaits import DEGREE
from snake_env.policies.scripted.controller import OMEGAS
from snake_env.policies.scripted.gaits import FILTER_DELAY, HeadingGait
from snake_env.policies.scripted.sensors import Array


class ContactReflex(HeadingGait):
    """Curvature runs from head to tail; contact forces bend the body where they act.

    In the spirit of Kano, Sato, Kobayashi and Ishiguro, *Local reflexive mechanisms essential for snakes'
    scaffold-based locomotion* (Bioinspiration and Biomimetics 7, 2012), and of the curvature-derivative control of
    Date and Takita that it builds on: the head swings and steers; each joint takes over the *measured* angle of the
    joint ahead of it after the time in which the body moves on by one link, so that bends which pegs have pressed
    into the body travel backwards with it; a local reflex adds an angle in proportion to the force on the link before
    and the link behind the joint. Whether a reflex grips the peg or gives way to it is the sign of its gain; tuning
    may choose either.
    """

    title = "contact reflex"
    mode = "joints"
    ranges: ClassVar = {
        "amplitude": (25 * DEGREE, 55 * DEGREE),
        "omega": OMEGAS,
        "beta": (-65 * DEGREE, -32 * DEGREE),
        "steering": (0.15, 0.6),
        "look_ahead": (0.5, 1.0),
        "compliance": (0.0, 1.0),
        "reflex_ahead": (-0.02, 0.02),
        "reflex_behind": (-0.02, 0.02),
    }
    """``compliance``: weight of the measured angle against the commanded one in what travels backwards; the reflexes'
    gains are in rad/N."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes."""
        self._phase = np.zeros(num_envs)
        self._fresh = np.ones(num_envs, np.bool_)
        super().begin(layout, num_envs)
        travel = np.abs(self["beta"]) / self["omega"]
        lag = self["compliance"] * FILTER_DELAY
        self._delay = np.clip(np.round((travel - lag) / self.period), 1, HISTORY).astype(int)
        self._history = np.zeros((HISTORY, num_envs, self.joints))
        self._commanded = np.zeros((num_envs, self.joints))

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """The robots in ``rows`` begin with the phase that their posture has."""
        self._fresh[rows] = True

    def command(self) -> Array:
        """Angles of all joints."""
        self._start_fresh()
        self._phase = self._phase + self["omega"] * self.period
        seen = self["compliance"][:, None] * (self.sensors["joint_angle"] - self._commanded) + self._commanded
        self._history = np.concatenate([seen[None], self._history[:-1]])
        ahead = self._history[self._delay - 1, np.arange(self.num_envs)]
        angle = np.empty_like(seen)
        angle[:, 0] = self["amplitude"] * np.sin(self._phase) + self.steering_offset()
        angle[:, 1:] = ahead[:, :-1]
        self._commanded = np.clip(angle, self._low, self._high)
        return self._commanded + self._reflex()

    def _reflex(self) -> Array:
        """Angles that contact forces add (n, joints)."""
        force = self.sensors["contact_force"]
        reflex = self["reflex_ahead"][:, None] * force[:, :-1] + self["reflex_behind"][:, None] * force[:, 1:]
        return np.clip(reflex, -LARGEST_REFLEX, LARGEST_REFLEX)

    def _start_fresh(self) -> None:
        """Takes the phase of the thesis's gait, in whose posture episodes begin, from the first two joints."""
        rows = self._fresh
        if rows.any():
            angle = self.sensors["joint_angle"][rows]
            sine = angle[:, 0]
            cosine = (angle[:, 1] - sine * np.cos(START_BETA)) / np.sin(START_BETA)
            self._phase[rows] = np.arctan2(sine, cosine)
            self._history[:, rows] = self._past(angle, self._delay[rows])
            self._commanded[rows] = angle
            rows[:] = False

    def _past(self, angle: Array, delay: NDArray[np.int64]) -> Array:
        """Angles before the start (history, n, joints): one delay ago a joint had the angle of the joint behind it."""
        behind = np.concatenate([angle[:, 1:], angle[:, -1:]], axis=1)
        share = np.minimum(np.arange(HISTORY)[:, None] / delay, 1.0)
        return angle + share[:, :, None] * (behind - angle)


HISTORY = 40
"""Control periods that are remembered."""

START_BETA = -50 * DEGREE
"""Phase shift of the posture at the start."""

LARGEST_REFLEX = 25 * DEGREE
"""A reflex bends a joint by no more than this [rad]."""
