"""Gaits that never change, as policies."""

from __future__ import annotations

from dataclasses import astuple, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.config.section import DEGREE, core_defaults
from snake_env.errors import ConfigError
from snake_env.policies.interface import PolicyBase, Stateless
from snake_env.policies.policy_card import PolicyCard

_THESIS = core_defaults("gait")


ACTIONS = {
    "amplitude": "amplitude",
    "omega": "frequency",
    "beta": "phase_shift",
    "gamma": "offset",
    "lift": "lift",
    "lift_phase": "lift_phase",
}
"""Parameter of a gait -> the action that commands it."""


@dataclass
class ConstantAction(Stateless):
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
        lift: amplitude of the vertical wave, only in 3D [rad].
        lift_phase: phase of the vertical wave against the horizontal one [rad].
    """

    amplitude: float = _THESIS.amplitude
    omega: float = _THESIS.omega
    beta: float = _THESIS.beta
    gamma: float = _THESIS.gamma
    lift: float = 0.0
    lift_phase: float = 0.0

    def __str__(self) -> str:
        wave = f"A {self.amplitude / DEGREE:.0f}, omega {self.omega / DEGREE:.0f}, beta {self.beta / DEGREE:.0f}"
        offset = f", gamma {self.gamma / DEGREE:.1f}" if self.gamma else ""
        lift = f", lift {self.lift / DEGREE:.0f} at {self.lift_phase / DEGREE:.0f}" if self.lift else ""
        return f"{wave}{offset}{lift} deg"

    @classmethod
    def default(cls, entries: list[dict[str, Any]]) -> GaitParameters:
        """The gait of action zero.

        Args:
            entries: the environment's table of actions in action mode ``gait``, ``layout["action"]``.
        """
        middle = {entry["name"]: 0.5 * (entry["low"] + entry["high"]) for entry in entries}
        return cls(**{parameter: middle[name] for parameter, name in ACTIONS.items() if name in middle})

    def action(self, entries: list[dict[str, Any]]) -> NDArray[np.float32]:
        """The constant action that commands this gait in action mode ``gait``.

        Args:
            entries: the environment's table of actions, ``layout["action"]``.

        Raises:
            ConfigError: the environment cannot command it.
        """
        wave = {name: getattr(self, parameter) for parameter, name in ACTIONS.items()}
        names = [entry["name"] for entry in entries]
        if self.lift and "lift" not in names:
            raise ConfigError("gait", self, "one without a vertical wave, which only the spatial model has")
        values = np.array([wave.get(name, 0.0) for name in names])
        low, high = (np.array([entry[end] for entry in entries]) for end in ("low", "high"))
        action = (2.0 * values - low - high) / (high - low)
        if np.any(np.abs(action) > 1.0 + 1e-9):
            raise ConfigError("gait", self, f"values the environment can command, {low} to {high} rad")
        return np.clip(action, -1.0, 1.0).astype(np.float32)


class GaitPolicy(PolicyBase):
    """A gait that never changes.

    Args:
        gait: its parameters; None: the default gait of the environment, action zero.
        name: shown in tables; by default the parameters.
    """

    def __init__(self, gait: GaitParameters | None = None, name: str | None = None) -> None:
        default = "gait" if gait is None else "thesis gait" if gait == GaitParameters() else str(gait)
        super().__init__(PolicyCard(name or default, "A gait that never changes.", env_options={"action_mode": "gait"}))
        self.gait, self._named = gait, name
        self.action: NDArray[np.float32] | None = None
        """(a,) commands the gait, once an environment is known."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Finds the action that commands the gait.

        Raises:
            ConfigError: the environment cannot command it.
        """
        entries = layout["action"]
        gait = self.gait or GaitParameters.default(entries)
        self.action = gait.action(entries)
        if self.gait is None and self._named is None:
            is_thesis = np.allclose(astuple(gait), astuple(GaitParameters()))
            self.name = "thesis gait" if is_thesis else "default gait"

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions (n, a)."""
        if self.action is None:
            self.begin_as_trained(len(observation))
        assert self.action is not None
        return np.tile(self.action, (len(observation), 1))
