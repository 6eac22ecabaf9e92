"""Strategies of evolution: which candidates to try next, and what their scores say about where the best ones lie."""

from __future__ import annotations

from typing import Any, Protocol

import cma
import numpy as np
import torch
from numpy.typing import NDArray

from snake_env import ConfigError
from training.config import EvolutionConfig

Array = NDArray[np.float64]


class Strategy(Protocol):
    """A search for the vector (size,) with the highest score."""

    @property
    def mean(self) -> Array:
        """The best guess so far (size,)."""
        ...

    def ask(self, steps: int) -> Array:
        """Candidates (c, size) around the mean; what they draw depends on the run's seed and ``steps`` only.

        Args:
            steps: Environment steps taken so far.
        """
        ...

    def tell(self, score: Array, used: float) -> dict[str, float]:
        """Moves the mean by the scores (c,) of the last candidates; only their ranks count.

        Args:
            score: Of the candidates, the higher the better.
            used: Share of the budget that is used up.

        Returns:
            Diagnostics by name.
        """
        ...

    def state_dict(self) -> dict[str, Any]:
        """What continues the search."""
        ...

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what :meth:`state_dict` returned."""


def make_strategy(config: EvolutionConfig, start: Array) -> Strategy:
    """The strategy that a configuration names, from a first mean.

    Raises:
        ConfigError: the robots do not make candidates on all fields, or too few of them.
    """
    fields = config.evolution.fields
    candidates, rest = divmod(config.num_envs, fields)
    if config.evolution.strategy == "cma":
        if rest or candidates < FEWEST:
            raise ConfigError("num_envs", config.num_envs, f"a multiple of evolution.fields, {FEWEST} times at least")
        return CovarianceAdaptation(config, start, candidates)
    if rest or candidates % 2 or not candidates:
        raise ConfigError("num_envs", config.num_envs, "a multiple of twice evolution.fields")
    return GradientEstimate(config, start, candidates // 2)


class GradientEstimate:
    """Estimates the direction in which the score rises from mirrored pairs, and follows it with Adam.

    After Salimans et al. 2017. The covariance of the candidates stays a multiple of the identity, so that networks of
    any size can be searched.

    Args:
        config: Of the run.
        start: First mean (size,).
        pairs: Pairs of candidates per generation.
    """

    def __init__(self, config: EvolutionConfig, start: Array, pairs: int) -> None:
        self._evolution, self._seed, self._pairs = config.evolution, config.seed, pairs
        self._mean = torch.from_numpy(start.copy())
        self._optimiser = torch.optim.Adam([self._mean], maximize=True)

    @property
    def mean(self) -> Array:
        """See :class:`Strategy`."""
        return self._mean.numpy()

    def ask(self, steps: int) -> Array:
        """See :class:`Strategy`; the second half mirrors the first."""
        rng = np.random.default_rng([self._seed, steps])
        self._changes = rng.normal(size=(self._pairs, len(self.mean)))
        return self.mean + self._evolution.spread * np.concatenate([self._changes, -self._changes])

    def tell(self, score: Array, used: float) -> dict[str, float]:
        """See :class:`Strategy`."""
        evolution = self._evolution
        rate = evolution.learning_rate * (1.0 - (1.0 - evolution.final_learning_rate) * used)
        for group in self._optimiser.param_groups:
            group["lr"] = rate
        direction = slope(self._changes, score)
        self._mean.grad = torch.from_numpy(direction)
        self._optimiser.step()
        return {"train/learning_rate": rate, "train/slope_norm": float(np.linalg.norm(direction))}

    def state_dict(self) -> dict[str, Any]:
        """See :class:`Strategy`."""
        return {"mean": self._mean, "optimiser": self._optimiser.state_dict()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """See :class:`Strategy`."""
        self._mean.copy_(state["mean"])
        self._optimiser.load_state_dict(state["optimiser"])


def slope(changes: Array, score: Array) -> Array:
    """Direction (size,) in which the score rises, from pairs of candidates on either side of the mean.

    Args:
        changes: of the first of each pair (p, size); the second has the opposite.
        score: of the first ones, then of the second ones (2 p,); only ranks count.
    """
    rank = np.empty(len(score))
    rank[np.argsort(score, kind="stable")] = np.linspace(-0.5, 0.5, len(score))
    ahead, behind = np.split(rank, 2)
    return (ahead - behind) @ changes / len(changes)


FEWEST = 4
"""Candidates of a generation of CMA-ES."""


class CovarianceAdaptation:
    """CMA-ES (Hansen 2016), which also learns in which directions candidates should differ: for few parameters.

    A covariance of n parameters has n (n + 1) / 2 numbers, 50,000 for the smallest network with a hidden layer that is
    shipped, which the scores of some hundred candidates per generation do not determine.

    Args:
        config: Of the run.
        start: First mean (size,).
        candidates: Per generation.
    """

    def __init__(self, config: EvolutionConfig, start: Array, candidates: int) -> None:
        self._seed = config.seed
        # A seed that is not a number leaves NumPy's global random state alone.
        options = {"popsize": candidates, "randn": self._normal, "seed": np.nan, "verbose": -9}
        self._search = cma.CMAEvolutionStrategy(start, config.evolution.spread, options)
        self._told: list[tuple[int, Array]] = []

    def _normal(self, *shape: int) -> Array:
        return self._rng.normal(size=shape)

    @property
    def mean(self) -> Array:
        """See :class:`Strategy`."""
        mean: Array = self._search.mean
        return mean

    def ask(self, steps: int) -> Array:
        """See :class:`Strategy`."""
        self._steps, self._rng = steps, np.random.default_rng([self._seed, steps])
        self._candidates = self._search.ask()
        return np.array(self._candidates)

    def tell(self, score: Array, used: float) -> dict[str, float]:
        """See :class:`Strategy`."""
        self._told.append((self._steps, score))
        self._search.tell(self._candidates, list(-score))
        axes = self._search.D
        return {"train/spread": float(self._search.sigma), "train/axis_ratio": float(axes.max() / axes.min())}

    def state_dict(self) -> dict[str, Any]:
        """What was told; see :class:`Strategy`."""
        steps, scores = zip(*self._told, strict=True) if self._told else ((), ())
        return {"steps": list(steps), "scores": torch.from_numpy(np.array(scores))}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Asks and tells again what was told before, which leads to the same state bit for bit."""
        for steps, score in zip(state["steps"], state["scores"].numpy(), strict=True):
            self.ask(steps)
            self.tell(score, 0.0)
