"""Evolution over the native batch of robots: learning without gradients and without noise on the actions.

In a generation of CMA-ES each candidate is a network of its own, the mean of all plus a random change, and plays a
whole episode on each of a few fields; the mean moves towards the changes that did well, and these become likelier. A
gait's worth lies in its exact repetition, which noise on the weights preserves and noise on the actions destroys.

Weights start at random, those of the last layer at zero, so that the first mean acts as action zero, the thesis's gait.
What a generation draws depends only on seed and steps: a run repeats itself bit for bit, also when it was stopped and
resumed.
"""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from snake_env import ConfigError
from snake_env.evaluation import seeds
from snake_env.evaluation.rollout import Episodes, make_env, play
from snake_env.policies import files
from snake_env.policies.memory import network_inputs
from snake_env.policies.network import Layers, outputs
from training.config import EvolutionConfig
from training.learners import loop
from training.learners.cma_es import CmaEs
from training.learning_curve import SIGNALS, Note
from training.policies.symmetry import Reflection
from training.runs import RunFolder

Array = NDArray[np.float64]

FEWEST = 4
"""Candidates of a generation."""
MOST_WEIGHTS = 2000
"""Of a network: the covariance of their changes has half the square of this number of elements."""


class Networks:
    """Layers with tanh between them, of many networks of one shape, each from a flat vector.

    A vector holds, layer by layer, weights times the root of the layer's inputs, and biases: so equal changes of its
    elements matter about equally.

    Args:
        observations: elements of an observation.
        actions: elements of an action.
        hidden: units of each hidden layer.
        sensed: elements of the observation that are inputs; all others are ignored.
        reflection: Signs that make the networks treat left and right alike; None: they need not.
    """

    def __init__(
        self,
        observations: int,
        actions: int,
        hidden: tuple[int, ...],
        sensed: list[int],
        reflection: Reflection | None,
    ) -> None:
        self._shapes = list(pairwise([len(sensed), *hidden, actions]))
        self._observations, self._sensed, self._reflection = observations, sensed, reflection
        self.size = sum((wide + 1) * high for wide, high in self._shapes)

    def start(self, rng: np.random.Generator) -> Array:
        """Random weights, zero in the last layer; biases are zero."""
        vector = np.zeros(self.size)
        for weight, _ in self._views(vector[None])[:-1]:
            weight[:] = rng.normal(size=weight.shape)
        return vector

    def layers(self, vectors: Array) -> Layers:
        """Of c networks at once, from vectors (c, size): weights (c, inputs, outputs), biases (c, 1, outputs)."""
        return [(weight / np.sqrt(weight.shape[1]), bias) for weight, bias in self._views(vectors)]

    def _views(self, vectors: Array) -> Layers:
        views, end = [], 0
        for wide, high in self._shapes:
            begin, middle, end = end, end + wide * high, end + (wide + 1) * high
            weight = vectors[:, begin:middle].reshape(-1, wide, high)
            views.append((weight, vectors[:, None, middle:end]))
        return views

    def act(self, layers: Layers, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (c n, a) of c networks, each for n of the observations (c n, o)."""

        def answer(observation: NDArray[np.float32]) -> Array:
            seen = observation[:, self._sensed].astype(np.float64).reshape(len(layers[0][0]), -1, len(self._sensed))
            return outputs(layers, seen)

        action = answer(observation)
        if self._reflection is not None:
            action = 0.5 * (action + self._reflection.action * answer(self._reflection.observed(observation)))
        return action.reshape(len(observation), -1).astype(np.float32)

    def arrays(self, vector: Array) -> files.Arrays:
        """Arrays of the policy file: layers by name, as those of PPO, and the signs."""
        named = {}
        for k, (weight, bias) in enumerate(self.layers(vector[None])):
            named[f"actor.{k}.weight"] = weight[0].T.astype(np.float32)
            named[f"actor.{k}.bias"] = bias[0, 0].astype(np.float32)
        first = np.zeros((len(named["actor.0.bias"]), self._observations), np.float32)
        first[:, self._sensed] = named["actor.0.weight"]
        named["actor.0.weight"] = first
        return named | ({} if self._reflection is None else self._reflection.arrays())


def sensed(layout: dict[str, Any], inputs: tuple[str, ...] | None) -> list[int]:
    """Indices of the elements of an observation that are named, or whose block is; None: all.

    Raises:
        ConfigError: the environment has no such block or element.
    """
    elements = network_inputs(layout, ())
    blocks = [element.partition(":")[0] for element in elements]
    for name in inputs or ():
        if name not in blocks and name not in elements:
            known_names = ", ".join(dict.fromkeys(blocks))
            raise ConfigError("evolution.inputs", name, f"some of {known_names}, or of their elements")
    names = zip(blocks, elements, strict=True)
    return [k for k, (block, element) in enumerate(names) if inputs is None or block in inputs or element in inputs]


class Learner:
    """A mean network in training, and the search that moves it.

    Args:
        config: of the run.
        steps: environment steps taken before.
        note: receives the finished episodes.

    Raises:
        ConfigError: the robots do not make candidates on all fields, or the network has too many weights.
    """

    checkpoint = ".pt"

    def __init__(self, config: EvolutionConfig, steps: int, note: Note) -> None:
        self.config, self.steps, self._note = config, steps, note
        self.simulator_seconds = 0.0
        candidates, rest = divmod(config.num_envs, config.evolution.fields)
        if rest or candidates < FEWEST:
            raise ConfigError(
                "num_envs", config.num_envs, f"a multiple of evolution.fields, at least {FEWEST} times it"
            )
        self._env = make_env(config.env_id, config.num_envs, config.num_threads, **config.env)
        layout = self._env.unwrapped.layout
        seen = sensed(layout, config.evolution.inputs)
        sizes = sum(block["size"] for block in layout["observation"]), len(layout["action"])
        reflection = Reflection.of(layout) if config.policy.symmetric else None
        self.networks = Networks(*sizes, config.policy.hidden, seen, reflection)
        if self.networks.size > MOST_WEIGHTS:
            reason = f"fewer units or evolution.inputs: at most {MOST_WEIGHTS} weights, not {self.networks.size}"
            raise ConfigError("policy.hidden", config.policy.hidden, reason)
        start = self.networks.start(np.random.default_rng(config.seed))
        self._search = CmaEs(start, config.evolution.spread, candidates, config.seed)

    @property
    def mean(self) -> Array:
        """The mean network as a vector (size,)."""
        return self._search.mean

    def collect(self) -> None:
        """Draws candidates around the mean and plays them."""
        count = self.config.evolution.fields
        first = seeds.training(self.config.seed, self.steps, count)
        played, steps = self.play(self._search.ask(self.steps), list(range(first, first + count)))
        for k, score in enumerate(played["return"]):
            self._note(score, {name: played[name][k] for name in SIGNALS})
        self._score = played["return"].reshape(-1, count).mean(axis=1)
        self.steps += steps

    def play(self, vectors: Array, fields: list[int]) -> tuple[Episodes, int]:
        """An episode of each network on each field (c f,), one network after another, and the steps this took."""
        layers = self.networks.layers(vectors)
        n = len(vectors) * len(fields)
        inside = 0.0

        def act(seen: NDArray[np.float32]) -> NDArray[np.float32]:
            nonlocal inside
            began = time.perf_counter()
            action = self.networks.act(layers, seen)
            inside += time.perf_counter() - began
            return action

        start = time.perf_counter()
        played, steps = play(self._env, act, fields * len(vectors))
        self.simulator_seconds += time.perf_counter() - start - inside
        return played, n * steps

    def learn(self, used: float) -> dict[str, float]:
        """Moves the mean; ``used`` is the share of the budget that is used up."""
        self._search.tell(self._score)
        return {
            "train/spread": self._search.spread,
            "train/score_mean": float(self._score.mean()),
            "train/score_std": float(self._score.std()),
            "train/mean_norm": float(np.linalg.norm(self.mean)),
        }

    def begin(self) -> None:
        """Begins as it was made."""

    def arrays(self) -> files.Arrays:
        """What playing needs: the mean network."""
        return self.networks.arrays(self.mean)

    def close(self) -> None:
        """Closes the batch."""
        self._env.close()

    def save(self, path: Path, curve: dict[str, Any]) -> None:
        """Writes a checkpoint."""
        torch.save({"search": self._search.state_dict(), "curve": curve}, path)

    def restore(self, path: Path) -> dict[str, Any]:
        """Takes over the search of a checkpoint; returns the state of the learning curve."""
        content = torch.load(path, weights_only=True)
        self._search.load_state_dict(content["search"])
        curve: dict[str, Any] = content["curve"]
        return curve


def train(folder: RunFolder, config: EvolutionConfig, show: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped."""
    torch.set_num_threads(config.torch_threads)
    return loop.run(folder, config, lambda steps, note, _used: Learner(config, steps, note), show)
