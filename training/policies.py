"""What drives a robot in an evaluation: a scripted gait, a constant action, or a trained model."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from snake_env import ConfigError
from training import policy_file
from training.traces import Traces, observed, times_of

DEGREE = math.pi / 180.0

INTERFACE = ("action_mode", "perception", "nearest_pegs", "control_period")
"""Keywords of the environment that belong to a policy; all others belong to the task it is judged in."""


def title(path: Path) -> str:
    """Name of a trained policy in tables: that of its file or, where all runs call it the same, of its run."""
    return path.parent.name if path.name in (policy_file.NAME, "model.zip") else path.stem


class Policy(Protocol):
    """Actions for a batch of robots, from observations alone: scripted policies sense what learned ones do."""

    name: str
    env_options: dict[str, Any]
    """Keywords of the environment that the policy needs, such as its action mode."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares for a batch of new episodes; ``layout`` is the environment's."""
        ...

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,), whose next observation begins an episode."""
        ...

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (n, a) in [-1, 1] for observations (n, o)."""
        ...


class Stateless:
    """A policy that remembers nothing."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Has nothing to prepare."""

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Has nothing to forget."""


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
    """

    amplitude: float = 40 * DEGREE
    omega: float = 80 * DEGREE
    beta: float = -50 * DEGREE
    gamma: float = 0.0

    def __str__(self) -> str:
        amplitude, omega, beta = (value / DEGREE for value in (self.amplitude, self.omega, self.beta))
        return f"A {amplitude:.0f}, omega {omega:.0f}, beta {beta:.0f} deg"

    def action(self, entries: list[dict[str, Any]]) -> NDArray[np.float32]:
        """The constant action that commands this gait in action mode ``gait``; in space without a vertical wave.

        Args:
            entries: the environment's table of actions, ``layout["action"]``.

        Raises:
            ConfigError: the environment cannot command it.
        """
        wave = [self.amplitude, self.omega, self.beta, self.gamma]
        values = np.array(wave + [0.0] * (len(entries) - len(wave)))
        low, high = (np.array([entry[end] for entry in entries]) for end in ("low", "high"))
        action = (2.0 * values - low - high) / (high - low)
        if np.any(np.abs(action) > 1.0 + 1e-9):
            raise ConfigError("gait", self, f"values the environment can command, {low} to {high} rad")
        return np.clip(action, -1.0, 1.0).astype(np.float32)


def scripted(gait: GaitParameters, entries: list[dict[str, Any]], name: str) -> ConstantAction:
    """A gait that never changes."""
    return ConstantAction(gait.action(entries), name, {"action_mode": "gait"})


def interface(options: dict[str, Any]) -> dict[str, Any]:
    """Those of an environment's keywords that belong to a policy."""
    return {name: value for name, value in options.items() if name in INTERFACE}


class Model(Stateless):
    """A trained Stable-Baselines3 policy, without exploration noise."""

    def __init__(self, path: Path, name: str = "policy", env_options: dict[str, Any] | None = None) -> None:
        from stable_baselines3 import PPO

        self.name = name
        self.env_options = interface(env_options or {})
        self._model = PPO.load(path, device="cpu")

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        return self._model.predict(observation, deterministic=True)[0]


Layers = list[tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Weights (..., inputs, outputs) and biases of each layer."""


class Network:
    """The actor of a file, without exploration noise: layers ``actor.<k>.weight`` and ``.bias`` with tanh between.

    With signs ``mirror.observation`` and ``mirror.action`` it is the mean of what they say and of what they say in the
    mirror, mirrored back.

    It computes in double precision: sums of single precision come out differently in batches of different size, and
    a robot among pegs soon tells the difference, so that a film would show another episode than the one scored.

    A policy with traces (``training/traces.py``) remembers; it has to be told where episodes begin.

    Args:
        path: what ``python -m training.ppo`` leaves as ``policy.safetensors``.
        name: shown in tables; by default the :func:`title`.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        arrays, self.config = policy_file.read(path)
        self.name = name or title(path)
        self.env_options = interface(self.config.get("env", {}))
        self._traces: Traces | None = None
        layers = sorted({int(key.split(".")[1]) for key in arrays if key.startswith("actor.")})
        if not layers:
            raise ValueError(f"{path}: expected arrays actor.<k>.weight, found {', '.join(arrays)}")
        double = {name: array.astype(np.float64) for name, array in arrays.items()}
        self._signs = (double["mirror.observation"], double["mirror.action"]) if "mirror.action" in double else None
        self._layers = [(double[f"actor.{k}.weight"].T.copy(), double[f"actor.{k}.bias"]) for k in layers]

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares a memory for a batch of new episodes.

        Raises:
            ConfigError: the environment's robots see other things than those that the policy was trained on.
        """
        sees, shown = len(self._layers[0][0]), len(observed(layout, times_of(self.config)))
        if sees != shown:
            raise ConfigError("policy", self.name, f"one that sees {shown} elements as here, this one sees {sees}")
        self._traces = Traces(layout, times_of(self.config), num_envs)

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,), whose next observation begins an episode."""
        if self._traces is not None:
            self._traces.forget(rows)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        if self._traces is None and times_of(self.config):
            raise RuntimeError(f"{self.name}: call begin() first, this policy remembers")
        seen = (observation if self._traces is None else self._traces(observation)).astype(np.float64)
        action = outputs(self._layers, seen)
        if self._signs is not None:
            of_observation, of_action = self._signs
            action = 0.5 * (action + of_action * outputs(self._layers, of_observation * seen))
        return action.astype(np.float32)


def outputs(layers: Layers, seen: NDArray[np.float64]) -> NDArray[np.float64]:
    """What layers with tanh between them say (..., a) of what is seen (..., o)."""
    *hidden, (weight, bias) = layers
    for inner, shift in hidden:
        seen = np.tanh(seen @ inner + shift)
    return seen @ weight + bias
