"""Trained networks, played with NumPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env.errors import ConfigError
from snake_env.policies import files
from snake_env.policies.interface import PolicyBase, title
from snake_env.policies.memory import MemoryTraces, network_inputs, time_constants
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.ranges import Conversion, have_equal_ranges

Double = NDArray[np.float64]
Layers = list[tuple[Double, Double]]
"""Weights (..., inputs, outputs) and biases of each layer."""

ACTIVATIONS: dict[str, Callable[[Double], Double]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "leakyrelu": lambda x: np.where(x > 0.0, x, 0.01 * x),
    "silu": lambda x: 0.5 * x * (1.0 + np.tanh(0.5 * x)),
}
"""Between layers, with torch's default parameters."""


class Mirror(NamedTuple):
    """The reflection of the input ``x`` is ``observation * x[order]``, that of the action ``u`` is ``action * u``."""

    observation: Double
    action: Double
    order: NDArray[np.int64]


class Scaling(NamedTuple):
    """Inputs are (x - mean) / deviation of observations x, within plus and minus clip, as of ``VecNormalize``."""

    mean: Double
    deviation: Double
    clip: Double

    def __call__(self, observation: Double) -> Double:
        """The inputs."""
        scaled: Double = np.clip((observation - self.mean) / self.deviation, -self.clip, self.clip)
        return scaled


class Network(PolicyBase):
    """The actor of a file, without exploration noise: layers ``actor.<k>.weight`` and ``.bias``.

    Between them is tanh, or what ``policy.activation`` of the configuration names; with ``policy.squash`` tanh also
    bounds the output. With ``normalize.mean``, ``.deviation`` and ``.clip`` the inputs are scaled. With signs
    ``mirror.observation`` and ``mirror.action`` it is the mean of the network's output and of its reflected output for
    the reflected observation, in which the input ``mirror.order[k]`` is in the place k.

    The action of a robot does not depend on the other robots of the batch, bit for bit: each robot is a product of its
    own. Products of the whole batch are summed in an order that depends on its size, contacts amplify the difference,
    and a film of one robot would show another episode than the one that was scored in a batch.

    A policy with memory must know where episodes begin: :meth:`begin`, :meth:`reset`. In an environment whose actions
    have other ranges than those of its training it commands the same waves and angles.

    Args:
        path: The file.
        name: shown in tables; by default the :func:`title`.
        read: from the file to its arrays and configuration.
    """

    def __init__(
        self, path: Path, name: str | None = None, read: Callable[[Path], tuple[files.Arrays, Any]] = files.read
    ) -> None:
        self.arrays, self.config = read(path)
        super().__init__(PolicyCard.of(name or title(path), self.config, path.with_suffix(".json")))
        self.times = time_constants(self.config)
        self._traces: MemoryTraces | None = None
        self._num_envs = 0
        self._ranges: tuple[Conversion, Conversion] | None = None
        self.layers = _layers_of(path, self.arrays)
        self.mirror = _mirror_of(path, self.arrays, self.layers)
        self.scaling = _scaling_of(path, self.arrays, self.layers)
        settings = self.config.get("policy", {})
        self.activation, self.squash = str(settings.get("activation", "tanh")), settings.get("squash") is True
        if self.activation not in ACTIVATIONS:
            raise ValueError(f"{path}: the activation {self.activation}, expected one of {', '.join(ACTIVATIONS)}")

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares a memory for a batch of new episodes.

        Raises:
            ConfigError: the environment's observations do not have the size that the policy was trained on.
        """
        self.require_inputs(len(network_inputs(layout, self.times)), len(self.layers[0][0]))
        self._traces = MemoryTraces(layout, self.times, num_envs)
        self._num_envs = num_envs
        self._ranges = self._conversions(layout)

    def _conversions(self, layout: dict[str, Any]) -> tuple[Conversion, Conversion] | None:
        """Of observations and actions to those of the training; None: ranges are equal, or unknown."""
        if self.card.env_id is None:
            return None
        trained = self._trained_layout
        if have_equal_ranges(layout, trained):
            return None
        done = [entry["name"] for entry in layout["action"]]
        return Conversion.of(network_inputs(layout, ()), layout, trained), Conversion.of(done, layout, trained)

    @cached_property
    def _trained_layout(self) -> dict[str, Any]:
        """Of the environment of the training."""
        env: Any = self.make_vec(1, num_threads=1)
        layout: dict[str, Any] = env.unwrapped.layout
        env.close()
        return layout

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
        if self.times and self._num_envs != len(batch):
            self.begin_as_trained(len(batch))
        if self._ranges is not None and batch.shape[1] == len(self._ranges[0].scale):
            batch = self._ranges[0](batch)
        seen = (batch if self._traces is None else self._checked(batch)).astype(np.float64)
        if seen.shape[1] != len(self.layers[0][0]):
            self._refuse(observation)
        if self.scaling is not None:
            seen = self.scaling(seen)
        activation = ACTIVATIONS[self.activation]
        action = outputs_alone(self.layers, seen, activation)
        if self.mirror is not None:
            reflected = self.mirror.observation * seen[:, self.mirror.order]
            action = 0.5 * (action + self.mirror.action * outputs_alone(self.layers, reflected, activation))
        if self.squash:
            action = np.tanh(action)
        acted = action.astype(np.float32)
        if self._ranges is not None:
            acted = self._ranges[1].back(np.clip(acted, -1.0, 1.0))
        return acted.reshape(*np.shape(observation)[:-1], -1)

    def _checked(self, batch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Observations and what is remembered of them; nothing is remembered of refused observations."""
        assert self._traces is not None
        if batch.shape[1] != len(self.layers[0][0]) - self._traces.size:
            self._refuse(batch)
        return self._traces(batch)

    def _refuse(self, observation: NDArray[np.float32]) -> None:
        expected = len(self.layers[0][0]) - (self._traces.size if self._traces is not None else 0)
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


def _mirror_of(path: Path, arrays: files.Arrays, layers: Layers) -> Mirror | None:
    """How observations and actions are reflected, if the policy is symmetric."""
    if not any(name.startswith("mirror.") for name in arrays):
        return None
    inputs, actions = layers[0][0].shape[0], layers[-1][0].shape[1]
    order = np.arange(inputs)
    if "mirror.order" in arrays:
        given = _array(path, arrays, "mirror.order", (inputs,))
        if (np.sort(given) != order).any():
            raise ValueError(f"{path}: mirror.order is no order of {inputs} inputs")
        order = given.astype(np.int64)
    observation = _array(path, arrays, "mirror.observation", (inputs,))
    return Mirror(observation, _array(path, arrays, "mirror.action", (actions,)), order)


def _scaling_of(path: Path, arrays: files.Arrays, layers: Layers) -> Scaling | None:
    """How inputs are scaled, if they are."""
    if not any(name.startswith("normalize.") for name in arrays):
        return None
    inputs = layers[0][0].shape[0]
    sizes = {"mean": inputs, "deviation": inputs, "clip": 1}
    return Scaling(*(_array(path, arrays, f"normalize.{name}", (size,)) for name, size in sizes.items()))


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


def outputs(layers: Layers, seen: Double, activation: Callable[[Double], Double] = np.tanh) -> Double:
    """Outputs (..., a) of layers with an activation between them for the inputs (..., o)."""
    *hidden, (weight, bias) = layers
    for inner, shift in hidden:
        seen = activation(seen @ inner + shift)
    return seen @ weight + bias


def outputs_alone(layers: Layers, seen: Double, activation: Callable[[Double], Double] = np.tanh) -> Double:
    """Outputs (n, a) of layers for the inputs (n, o), each row bit for bit as if it were alone.

    A stack of products of one row each: every product has the same shape, and so the same order of summation.
    """
    return outputs(layers, seen[:, None], activation)[:, 0]
