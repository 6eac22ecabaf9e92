"""Records of a policy at work: which links the pegs push, and how episodes end."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.evaluation.rollout import Episodes
from snake_env.policies.interface import Policy
from snake_env.policies.scripted.sensors import Array, Sensors

STUCK_TIME, STUCK_WAY = 5.0, 0.1
"""A robot is stuck at the end if it has moved less than this [m] in the last seconds [s]."""

KINDS = ("goal reached", "left the corridor", "time up, stuck", "time up, on its way")


class RecordedPolicy:
    """A policy that records what it senses.

    Args:
        policy: acts.

    Attributes:
        force: step by step, force of the pegs on each link towards the goal (n, links) [N]; negative: it brakes.
        remaining: step by step, distance left relative to that at the start (n,).
        wave: step by step, the parameters of the wave by name (n,) [deg, deg/s]; empty where joints are commanded.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self.name, self.env_options = policy.name, policy.env_options

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes."""
        self._sensors = Sensors(layout)
        self.force: list[Array] = []
        self.remaining: list[Array] = []
        self.wave: list[dict[str, Array]] = []
        self._layout = layout
        self.period = float(layout["control_period"])
        self._policy.begin(layout, num_envs)

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """The robots in ``rows`` begin an episode."""
        self._policy.reset(rows)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a) for observations (n, o)."""
        sensors = self._sensors
        sensors.read(observation)
        self.force.append(push_ahead(sensors))
        self.remaining.append(sensors["goal"][:, 0])
        self.wave.append(wave_parameters(sensors, self._layout))
        return self._policy(observation)

    def during(self, episodes: Episodes) -> NDArray[np.bool_]:
        """Which of the steps (T, n) belong to the episodes."""
        steps = np.round(episodes["time"] / self.period)
        return np.arange(len(self.force))[:, None] < steps

    def kinds(self, episodes: Episodes, goal: float) -> NDArray[np.int64]:
        """How each episode ended (n,), an index to ``KINDS``; the goal is so many metres away."""
        last = np.round(episodes["time"] / self.period).astype(int) - 1
        robots, remaining = np.arange(len(last)), np.array(self.remaining) * goal
        before = np.maximum(last - round(STUCK_TIME / self.period), 0)
        stuck = remaining[before, robots] - remaining[last, robots] < STUCK_WAY
        success, left = episodes["is_success"].astype(bool), episodes["left_corridor"].astype(bool)
        return np.select([success, left, stuck], [0, 1, 2], 3)


def push_ahead(sensors: Sensors) -> Array:
    """Component of the pegs' force on each link along the goal direction (n, links) [N].

    A force f to the left of a link with the direction psi has the component -f sin(psi).
    """
    return -sensors["contact_force"] * np.sin(sensors.link_directions)


def wave_parameters(sensors: Sensors, layout: dict[str, Any]) -> dict[str, Array]:
    """The smoothed parameters of the wave in degrees and degrees per second; none where joints are commanded."""
    if not sensors.has("wave"):
        return {}
    entries = layout["action"][:4]
    values = [
        entry["low"] + 0.5 * (column + 1.0) * (entry["high"] - entry["low"])
        for entry, column in zip(entries, sensors["wave"][:, 2:].T, strict=True)
    ]
    names = ("amplitude", "frequency", "phase shift", "offset")
    return {name: np.degrees(value) for name, value in zip(names, values, strict=True)}
