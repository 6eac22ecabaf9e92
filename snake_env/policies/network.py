"""Trained networks, played with NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env.errors import ConfigError
from snake_env.policies import files
from snake_env.policies.interface import interface, named_task, title
from snake_env.policies.memory import MemoryTraces, network_inputs, time_constants
from snake_env.policies.policy_card import PolicyCard

Double = NDArray[np.float64]
Layers = list[tuple[Double, Double]]
"""Weights (..., inputs, outputs) and biases of each layer."""


class Network:
    """The actor of a file, without exploration noise: layers ``actor.<k>.weight`` and ``.bias`` with tanh between.

    With signs ``mirror.observation`` and ``mirror.action`` it is the mean of the network's output and of its reflected
    output for the reflected observation.

    The action of a robot does not depend on the other robots of the batch, bit for bit: each robot is a product of its
    own. Products of the whole batch are summed in an order that depends on its size, contacts amplify the difference,
    and a film of one robot would show another episode than the one that was scored in a batch.

    A policy with memory must know where episodes begin: :meth:`begin`, :meth:`reset`.

    Args:
        path: The file.
        name: shown in tables; by default the :func:`title`.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        arrays, self.config = files.read(path)
        self.name = name or title(path)
        self.card = PolicyCard.of(self.name, self.config, path.with_suffix(".json"))
        """What the policy is, where it was trained and how it scored."""
        self.env_options = interface(self.config.get("env", {}))
        self._times = time_constants(self.config)
        self._traces: MemoryTraces | None = None
        self._num_envs = 0
        self._layers = _layers_of(path, arrays)
        self._signs = _signs_of(path, arrays, self._layers)

    def make_vec(self, num_envs: int = 1, **options: Any) -> gym.vector.VectorEnv:
        """The environment in which the policy was trained, as a native batch.

        Episodes restart in the step in which they end, unless ``autoreset_mode`` says otherwise; hand
        ``terminated | truncated`` to :meth:`reset`.

        Args:
            num_envs: Robots.
            **options: Keywords of the environment that override those of the training.

        Raises:
            ConfigError: the file names an environment that is not one of this package's, or a keyword that is not
                admissible.
        """
        env_id, trained = named_task(self.card.env_id, self.card.env_options)
        return gym.make_vec(env_id, num_envs=num_envs, **{"autoreset_mode": "SameStep"} | trained | options)

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares a memory for a batch of new episodes.

        Raises:
            ConfigError: the environment's observations do not have the size that the policy was trained on.
        """
        sees, shown = len(self._layers[0][0]), len(network_inputs(layout, self._times))
        if sees != shown:
            raise ConfigError(
                "policy", self.name, f"a policy with {shown} inputs, as this environment provides; this one has {sees}"
            )
        self._traces = MemoryTraces(layout, self._times, num_envs)
        self._num_envs = num_envs

    def reset(self, rows: NDArray[np.bool_] | None = None) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,), whose next observation begins an episode.

        None: of all robots.
        """
        if self._traces is not None:
            self._traces.reset(np.ones(self._num_envs, np.bool_) if rows is None else rows)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a) for observations (n, o), or (a,) for (o,).

        A batch of another size than the one before begins anew.

        Raises:
            ConfigError: the observations are not those that the policy was trained on.
        """
        batch = np.atleast_2d(np.asarray(observation, np.float32))
        if self._times and self._num_envs != len(batch):
            self._begin_as_trained(len(batch))
        seen = (batch if self._traces is None else self._checked(batch)).astype(np.float64)
        if seen.shape[1] != len(self._layers[0][0]):
            self._refuse(observation)
        action = outputs_alone(self._layers, seen)
        if self._signs is not None:
            of_observation, of_action = self._signs
            action = 0.5 * (action + of_action * outputs_alone(self._layers, of_observation * seen))
        return action.astype(np.float32).reshape(*np.shape(observation)[:-1], -1)

    def _begin_as_trained(self, num_envs: int) -> None:
        env: Any = self.make_vec(1, num_threads=1)
        self.begin(env.unwrapped.layout, num_envs)
        env.close()

    def _checked(self, batch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Observations and what is remembered of them; nothing is remembered of refused observations."""
        assert self._traces is not None
        if batch.shape[1] != len(self._layers[0][0]) - self._traces.size:
            self._refuse(batch)
        return self._traces(batch)

    def _refuse(self, observation: NDArray[np.float32]) -> None:
        expected = len(self._layers[0][0]) - (self._traces.size if self._traces is not None else 0)
        found = f"shape {np.shape(observation)}"
        raise ConfigError("observation", found, f"(n, {expected}), as in {self.card.env_id} with {self.env_options}")


def _layers_of(path: Path, arrays: files.Arrays) -> Layers:
    """The layers of a file, each of which takes the outputs of the one before."""
    numbers = sorted({int(key.split(".")[1]) for key in arrays if key.startswith("actor.")})
    if not numbers:
        raise ValueError(f"{path}: expected arrays actor.<k>.weight, found {', '.join(arrays)}")
    layers: Layers = []
    for k in numbers:
        weight = _array(path, arrays, f"actor.{k}.weight", (None, layers[-1][0].shape[1] if layers else None))
        layers.append((weight.T.copy(), _array(path, arrays, f"actor.{k}.bias", (weight.shape[0],))))
    return layers


def _signs_of(path: Path, arrays: files.Arrays, layers: Layers) -> tuple[Double, Double] | None:
    """Signs of the reflected observation and action, if the policy is symmetric."""
    if not any(name.startswith("mirror.") for name in arrays):
        return None
    inputs, actions = layers[0][0].shape[0], layers[-1][0].shape[1]
    return (
        _array(path, arrays, "mirror.observation", (inputs,)),
        _array(path, arrays, "mirror.action", (actions,)),
    )


def _array(path: Path, arrays: files.Arrays, name: str, shape: tuple[int | None, ...]) -> Double:
    """A finite array of a file in double precision; None in ``shape``: of any size.

    Raises:
        ValueError: it is missing, of another shape or not finite.
    """
    if name not in arrays:
        raise ValueError(f"{path}: {name} is missing")
    array = arrays[name]
    fits = len(array.shape) == len(shape) and all(one in (None, n) for one, n in zip(shape, array.shape, strict=True))
    fits = fits and array.size > 0
    if not fits:
        expected = ", ".join("any" if one is None else str(one) for one in shape)
        raise ValueError(f"{path}: {name} has the shape {array.shape}, expected ({expected})")
    if not np.isfinite(array).all():
        raise ValueError(f"{path}: {name} has numbers that are not finite")
    return array.astype(np.float64)


def outputs(layers: Layers, seen: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outputs (..., a) of layers with tanh between them for the inputs (..., o)."""
    *hidden, (weight, bias) = layers
    for inner, shift in hidden:
        seen = np.tanh(seen @ inner + shift)
    return seen @ weight + bias


def outputs_alone(layers: Layers, seen: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outputs (n, a) of layers for the inputs (n, o), each row bit for bit as if it were alone.

    A stack of products of one row each: every product has the same shape, and so the same order of summation.
    """
    return outputs(layers, seen[:, None])[:, 0]
