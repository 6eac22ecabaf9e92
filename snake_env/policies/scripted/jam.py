"""A controller that notices jams and rotates the links at the jammed contacts so as to push free."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snake_env.policies.gaits import DEGREE
from snake_env.policies.scripted.controller import AMPLITUDES, OMEGAS
from snake_env.policies.scripted.gaits import HeadingGait
from snake_env.policies.scripted.sensors import Array


class JamResolving(HeadingGait):
    """Heading control while the robot moves; where it is stuck, the links in contact are turned to be pushed ahead.

    In the spirit of Liljebaeck, Pettersen, Stavdahl and Gravdahl, *Hybrid modelling and control of obstacle-aided snake
    robot locomotion* (IEEE Transactions on Robotics 26, 2010): a hybrid controller leaves the leader-follower motion
    when the robot is jammed, and rotates each link in contact so that the peg's force on it gets a larger component
    along the direction of travel. Here the leader-follower motion is the travelling wave.

    A force f to the left of a link with the direction psi pushes it by -f sin(psi - psi_d) along the wanted direction
    psi_d, so the link is turned by -rotation sign(f) cos(psi - psi_d), weighted by its share of the largest force,
    with the joints before and behind it in opposite directions.
    """

    title = "jam resolving"
    mode = "residual"
    ranges: ClassVar = {
        "amplitude": AMPLITUDES,
        "omega": OMEGAS,
        "beta": (-65 * DEGREE, -32 * DEGREE),
        "steering": (0.15, 0.3),
        "look_ahead": (0.5, 1.0),
        "rotation": (8 * DEGREE, 20 * DEGREE),
        "slow": (0.02, 0.04),
        "creep": (0.0, 1.0),
    }
    """``slow``: speed below which the robot counts as stuck [m/s]; ``creep``: share of omega kept meanwhile."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes."""
        self._slow_time = np.zeros(num_envs)
        self._pushing = np.zeros(num_envs)
        super().begin(layout, num_envs)

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """The robots in ``rows`` are not stuck."""
        self._slow_time[rows] = 0.0
        self._pushing[rows] = 0.0

    def command(self) -> Array:
        """The wave; slowed, and with the links in contact turned, while the robot is stuck."""
        stuck = self._note_jams()
        wave = super().command()
        wave[stuck, 1] *= self["creep"][stuck]
        return np.concatenate([wave, np.where(stuck[:, None], self._rotations(), 0.0)], axis=1)

    def _note_jams(self) -> NDArray[np.bool_]:
        """Which robots are stuck: slow for a while, and then until a push has lasted for a while."""
        slow = self.sensors.speed < self["slow"]
        self._slow_time = np.where(slow, self._slow_time + self.period, 0.0)
        self._pushing = np.where(self._slow_time > PATIENCE, PUSH_TIME, np.maximum(self._pushing - self.period, 0.0))
        return self._pushing > 0.0

    def _rotations(self) -> Array:
        """Offsets of the joints (n, joints) that turn the links in contact [rad]."""
        force = self.sensors["contact_force"]
        share = force / np.maximum(np.abs(force).max(axis=1, keepdims=True), SMALLEST_FORCE)
        tilt = self.sensors.link_directions - self.wanted_heading()[:, None]
        turn = -self["rotation"][:, None] * share * np.cos(tilt)
        return turn[:, 1:] - turn[:, :-1]


PATIENCE = 0.5
"""A robot is stuck when it has been slow for so long [s]."""

PUSH_TIME = 0.5
"""And pushes for at least so long [s]."""

SMALLEST_FORCE = 1.0
"""Forces below this count less [N]."""
