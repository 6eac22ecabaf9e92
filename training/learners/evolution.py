"""Evolution strategies in one file, over the native batch: learning without noise on the actions.

    python -m training.learners.evolution --config isotropic-evolved --seed 0 --out runs/isotropic-evolved

After Salimans et al. 2017: a generation is a batch in which each robot has a network of its own, the mean of all plus
or minus a random change, plays one whole episode, and the mean moves towards the changes that did well. What a gait is
worth lies in its exact repetition; noise on the weights leaves that as it is, where noise on the actions destroys it.

It takes configurations that have a section ``evolution``, and leaves the same folder as ``training.learners.ppo``.
Weights start at random but for those of the last layer, which are zero, so that the first mean acts as action zero,
the thesis's gait. What a generation draws depends on seed and steps alone: a run whose budget is steps repeats itself
bit for bit, also when it was stopped and resumed in between.
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from snake_env import ConfigError
from training import run_command, seeds
from training.config import Config, Evolution
from training.learners.ppo import Note, run
from training.learning_curve import SIGNALS
from training.policies import files, symmetry
from training.policies.memory import observed
from training.policies.network import Layers, outputs
from training.rollout import Episodes, make_env, play
from training.runs import RunFolder

Array = NDArray[np.float64]

POLICY = files.NAME


class Networks:
    """Layers with tanh between them, of many networks of one shape, each from a flat vector.

    A vector holds, layer by layer, weights times the root of the layer's inputs, and biases: so equal changes of its
    elements matter about equally.

    Args:
        observations: elements of an observation.
        actions: elements of an action.
        hidden: units of each hidden layer.
        sensed: elements of the observation that are inputs; all others are ignored.
        sides: makes the networks treat left and right alike.
    """

    def __init__(
        self,
        observations: int,
        actions: int,
        hidden: tuple[int, ...],
        sensed: list[int],
        sides: symmetry.Mirror | None,
    ) -> None:
        self._shapes = list(pairwise([len(sensed), *hidden, actions]))
        self._observations, self._sensed, self._sides = observations, sensed, sides
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
        seen = observation[:, self._sensed].astype(np.float64).reshape(len(layers[0][0]), -1, len(self._sensed))
        action = outputs(layers, seen)
        if self._sides is not None:
            mirrored = outputs(layers, self._sides.observation[self._sensed] * seen)
            action = 0.5 * (action + self._sides.action * mirrored)
        return action.reshape(len(observation), -1).astype(np.float32)

    def arrays(self, vector: Array) -> files.Arrays:
        """What playing needs: layers by name, as in ``training.learners.ppo``, and the mirror's signs."""
        named = {}
        for k, (weight, bias) in enumerate(self.layers(vector[None])):
            named[f"actor.{k}.weight"] = weight[0].T.astype(np.float32)
            named[f"actor.{k}.bias"] = bias[0, 0].astype(np.float32)
        first = np.zeros((len(named["actor.0.bias"]), self._observations), np.float32)
        first[:, self._sensed] = named["actor.0.weight"]
        named["actor.0.weight"] = first
        return named | ({} if self._sides is None else self._sides.arrays())


class Adam:
    """Steps uphill along noisy gradients (Kingma and Ba 2015).

    Args:
        size: elements of a gradient.
    """

    def __init__(self, size: int) -> None:
        self.count = np.zeros(1)
        self.first, self.second = np.zeros(size), np.zeros(size)

    def step(self, gradient: Array, rate: float) -> Array:
        """By how much to move (size,)."""
        self.count += 1.0
        self.first += (1.0 - FIRST_DECAY) * (gradient - self.first)
        self.second += (1.0 - SECOND_DECAY) * (gradient**2 - self.second)
        mean = self.first / (1.0 - FIRST_DECAY**self.count)
        square = self.second / (1.0 - SECOND_DECAY**self.count)
        return rate * mean / (np.sqrt(square) + 1e-8)


FIRST_DECAY, SECOND_DECAY = 0.9, 0.999


def slope(changes: Array, score: Array) -> Array:
    """Direction (size,) in which the score rises, from pairs of candidates on either side of the mean.

    Args:
        changes: of the first of each pair (p, size); the second has the opposite.
        score: of the first ones, then of the second ones (2 p,); ranks alone count.
    """
    rank = np.empty(len(score))
    rank[np.argsort(score, kind="stable")] = np.linspace(-0.5, 0.5, len(score))
    ahead, behind = np.split(rank, 2)
    return (ahead - behind) @ changes / len(changes)


def sensed(layout: dict[str, Any], senses: tuple[str, ...] | None) -> list[int]:
    """Places of the elements of an observation that are named, alone or by their block; None: of all.

    Raises:
        ConfigError: the environment has no such block or element.
    """
    elements = observed(layout, ())
    blocks = [element.partition(":")[0] for element in elements]
    for name in senses or ():
        if name not in blocks and name not in elements:
            known_names = ", ".join(dict.fromkeys(blocks))
            raise ConfigError("evolution.senses", name, f"some of {known_names}, or of their elements")
    names = zip(blocks, elements, strict=True)
    return [k for k, (block, element) in enumerate(names) if senses is None or block in senses or element in senses]


def section(config: Config) -> Evolution:
    """What a configuration says of evolution.

    Raises:
        ConfigError: nothing: it is for another learner.
    """
    if config.evolution is None:
        raise ConfigError("evolution", None, "a section of this name, as in the configuration isotropic-evolved")
    return config.evolution


class Learner:
    """A mean network in training, and the optimiser that moves it.

    Args:
        config: of the run.
        steps: environment steps taken before.
        note: is told of finished episodes.

    Raises:
        ConfigError: the configuration is for another learner, has an option of one, or the robots do not make pairs of
            candidates on all fields.
    """

    def __init__(self, config: Config, steps: int, note: Note) -> None:
        self.config, self.steps, self._note = config, steps, note
        self._evolution = section(config)
        config.refuse("training.learners.evolution", "clone", "curriculum", "policy.traces", "policy.bfloat16")
        self._pairs, rest = divmod(config.num_envs, 2 * self._evolution.fields)
        if rest or not self._pairs:
            raise ConfigError("num_envs", config.num_envs, "a multiple of twice evolution.fields")
        self._env = make_env(config.env_id, config.num_envs, config.num_threads, **config.env)
        layout = self._env.unwrapped.layout
        seen = sensed(layout, self._evolution.senses)
        sizes = sum(block["size"] for block in layout["observation"]), len(layout["action"])
        sides = symmetry.Mirror.of(layout) if config.policy.mirror else None
        self.networks = Networks(*sizes, config.policy.hidden, seen, sides)
        self.mean = self.networks.start(np.random.default_rng(config.seed))
        self.optimiser = Adam(self.networks.size)

    def collect(self) -> None:
        """Draws candidates around the mean and plays them."""
        evolution = self._evolution
        rng = np.random.default_rng([self.config.seed, self.steps])
        self._changes = rng.normal(size=(self._pairs, self.networks.size))
        moves = evolution.spread * np.concatenate([self._changes, -self._changes])
        first = seeds.training(self.config.seed, self.steps, evolution.fields)
        fields = list(range(first, first + evolution.fields))
        played, steps = self.play(self.mean + moves, fields)
        for k, score in enumerate(played["return"]):
            self._note(score, {name: played[name][k] for name in SIGNALS})
        self._score = played["return"].reshape(-1, evolution.fields).mean(axis=1)
        self.steps += steps

    def play(self, vectors: Array, fields: list[int]) -> tuple[Episodes, int]:
        """An episode of each network on each field (c f,), one network after another, and the steps this took."""
        layers = self.networks.layers(vectors)
        n = len(vectors) * len(fields)
        played, steps = play(self._env, lambda seen: self.networks.act(layers, seen), fields * len(vectors))
        return played, n * steps

    def learn(self, used: float) -> None:
        """Moves the mean; ``used`` is the share of the budget that is used up."""
        evolution = self._evolution
        rate = evolution.learning_rate * (1.0 - (1.0 - evolution.final_learning_rate) * used)
        self.mean += self.optimiser.step(slope(self._changes, self._score), rate)

    def begin(self) -> None:
        """Begins as it was made."""

    def arrays(self) -> files.Arrays:
        """What playing needs: the mean network."""
        return self.networks.arrays(self.mean)

    def close(self) -> None:
        """Closes the batch."""
        self._env.close()

    def _state(self) -> dict[str, Array]:
        own = self.optimiser
        return {"mean": self.mean, "count": own.count, "first": own.first, "second": own.second}

    def save(self, path: Path) -> None:
        """Writes a checkpoint."""
        np.savez(path, **cast(Any, self._state()))

    def restore(self, path: Path) -> None:
        """Takes over the mean and the optimiser of a checkpoint."""
        with np.load(path) as content:
            for name, array in self._state().items():
                array[:] = content[name]


def train(folder: RunFolder, config: Config, show: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped."""
    return run(folder, config, lambda steps, note, _used: Learner(config, steps, note), show)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    return run_command.parser("training.learners.evolution", __doc__)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget has been used up, 130 when it was stopped."""
    args = parser().parse_args(arguments)
    return run_command.run(args, RunFolder(args.out, POLICY, ".npz"), train)


if __name__ == "__main__":
    sys.exit(main())
