"""Trained networks, played with NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import ConfigError
from training.policies import files
from training.policies.interface import interface, title
from training.policies.memory import MemoryTraces, network_inputs, time_constants

Layers = list[tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Weights (..., inputs, outputs) and biases of each layer."""


class Network:
    """The actor of a file, without exploration noise: layers ``actor.<k>.weight`` and ``.bias`` with tanh between.

    With signs ``mirror.observation`` and ``mirror.action`` it is the mean of the network's output and of its reflected
    output for the reflected observation.

    It computes in double precision: sums of single precision come out differently in batches of different size, and
    a robot among pegs soon tells the difference, so that a film would show another episode than the one scored.

    A policy with memory traces must be told where episodes begin: :meth:`begin`, :meth:`reset`.

    Args:
        path: The file.
        name: shown in tables; by default the :func:`title`.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        arrays, self.config = files.read(path)
        self.name = name or title(path)
        self.env_options = interface(self.config.get("env", {}))
        self._traces: MemoryTraces | None = None
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
        sees, shown = len(self._layers[0][0]), len(network_inputs(layout, time_constants(self.config)))
        if sees != shown:
            raise ConfigError("policy", self.name, f"one that sees {shown} elements as here, this one sees {sees}")
        self._traces = MemoryTraces(layout, time_constants(self.config), num_envs)

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,), whose next observation begins an episode."""
        if self._traces is not None:
            self._traces.reset(rows)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        if self._traces is None and time_constants(self.config):
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
