"""Gaits that need no pegs to be known: a tapered wave, and one that keeps its heading."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from snake_env.policies.scripted.controller import AMPLITUDES, BETAS, OMEGAS, Controller
from snake_env.policies.scripted.sensors import Array

FILTER_DELAY = 0.1
"""Time by which joint references lag behind actions at the default control period [s]."""


class TaperedGait(Controller):
    """The best wave A sin(omega t + (i - 1) beta) (T 7.1) of a grid, with an amplitude that may fall towards the head.

    Joint i of m has the amplitude A (1 - taper (m - i) / (m - 1)), as far as the offsets of single joints reach; a
    negative taper widens the head's. Serpentine waves whose amplitude grows from head to tail are those of swimming
    snakes (Hirose, *Biologically Inspired Robots*, 1993).
    """

    title = "best gait"
    mode = "residual"
    ranges: ClassVar = {
        "amplitude": AMPLITUDES,
        "omega": OMEGAS,
        "beta": BETAS,
        "taper": (-0.3, 0.3),
    }

    def command(self) -> Array:
        """The wave, and at each joint what it is to differ by."""
        wave = np.stack([self["amplitude"], self["omega"], self["beta"], np.zeros(self.num_envs)], axis=1)
        share = np.linspace(1.0, 0.0, self.joints)
        phase = self.sensors.phase + self["omega"] * FILTER_DELAY
        angle = phase[:, None] + np.outer(self["beta"], np.arange(self.joints))
        return np.concatenate([wave, -(self["taper"] * self["amplitude"])[:, None] * share * np.sin(angle)], axis=1)


class HeadingGait(Controller):
    """The wave with its offset gamma in feedback of the heading, and the heading of the way back to the centre line.

    After Liljebaeck, Haugstuen and Pettersen, *Path following control of planar snake robots using a cascaded
    approach* (IEEE Transactions on Control Systems Technology 20, 2012): line-of-sight guidance with a look-ahead
    distance, and a joint offset in proportion to the heading's error.
    """

    title = "heading control"
    mode = "gait"
    ranges: ClassVar = {
        "amplitude": AMPLITUDES,
        "omega": OMEGAS,
        "beta": BETAS,
        "steering": (0.15, 0.6),
        "look_ahead": (0.5, 2.0),
    }

    def command(self) -> Array:
        """The wave with its steering offset."""
        return np.stack([self["amplitude"], self["omega"], self["beta"], self.steering_offset()], axis=1)

    def steering_offset(self) -> Array:
        """Offset gamma (n,) [rad]; positive turns the head to the right."""
        return self["steering"] * (self.sensors.heading - self.wanted_heading())

    def wanted_heading(self) -> Array:
        """Direction towards the point of the centre line that lies the look-ahead distance ahead (n,) [rad].

        That of the centre line for a robot that does not know its lateral offset.
        """
        if not self.sensors.has("lateral_offset"):
            return np.zeros(self.num_envs)
        return -np.arctan2(self.sensors["lateral_offset"][:, 0], self["look_ahead"])
