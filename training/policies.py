"""What drives a robot in an evaluation: a scripted gait, a constant action, or a trained model."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

DEGREE = math.pi / 180.0


class Policy(Protocol):
    """Actions for a batch of robots."""

    name: str
    env_options: dict[str, Any]
    """Keywords of the environment that the policy needs, such as its action mode."""

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a) in [-1, 1] for observations (n, o)."""
        ...


@dataclass
class ConstantAction:
    """The same action at all times: one for all robots (a,), or one each (n, a)."""

    action: NDArray[np.float32]
    name: str = "constant action"
    env_options: dict[str, Any] = field(default_factory=dict)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions (n, a)."""
        shape = (len(observation), self.action.shape[-1])
        return np.broadcast_to(self.action, shape).astype(np.float32)


@dataclass(frozen=True)
class GaitParameters:
    """A travelling wave A sin(omega t + (i - 1) beta) + gamma (T 7.1); the defaults are the thesis's (T 7.3).

    Args:
        amplitude: A [rad].
        omega: [rad/s].
        beta: phase shift between adjacent joints [rad].
        gamma: offset of all joints [rad].
    """

    amplitude: float = 40 * DEGREE
    omega: float = 80 * DEGREE
    beta: float = -50 * DEGREE
    gamma: float = 0.0

    def __str__(self) -> str:
        amplitude, omega, beta = (value / DEGREE for value in (self.amplitude, self.omega, self.beta))
        return f"A {amplitude:.0f}, omega {omega:.0f}, beta {beta:.0f} deg"

    def action(self, entries: list[dict[str, Any]]) -> NDArray[np.float32]:
        """The constant action that commands this gait in action mode ``gait``.

        Args:
            entries: the environment's table of actions, ``layout["action"]``.
        """
        values = [self.amplitude, self.omega, self.beta, self.gamma]
        low, high = (np.array([entry[end] for entry in entries]) for end in ("low", "high"))
        action = (2.0 * np.array(values) - low - high) / (high - low)
        if np.any(np.abs(action) > 1.0 + 1e-9):
            raise ValueError(f"gait = {self}: expected values the environment can command, {low} to {high} rad")
        return np.clip(action, -1.0, 1.0).astype(np.float32)


def scripted(gait: GaitParameters, entries: list[dict[str, Any]], name: str) -> ConstantAction:
    """A gait that never changes."""
    return ConstantAction(gait.action(entries), name, {"action_mode": "gait"})


class Model:
    """A trained Stable-Baselines3 policy, without exploration noise."""

    def __init__(self, path: Path, name: str = "policy", env_options: dict[str, Any] | None = None) -> None:
        from stable_baselines3 import PPO

        self.name = name
        self.env_options = dict(env_options or {})
        self._model = PPO.load(path, device="cpu")

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        return self._model.predict(observation, deterministic=True)[0]
