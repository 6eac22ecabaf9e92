"""CMA-ES (Hansen 2016) of the package ``cma``, with random numbers and checkpoints that let a run repeat itself."""

from __future__ import annotations

from typing import Any

import cma
import numpy as np
import torch
from numpy.typing import NDArray

Array = NDArray[np.float64]


class CmaEs:
    """A search for the vector (size,) with the highest score.

    Args:
        start: First mean (size,).
        spread: Standard deviation of the candidates around it.
        candidates: Per generation.
        seed: Of the run; what a generation draws depends only on it and on the steps taken before.
    """

    def __init__(self, start: Array, spread: float, candidates: int, seed: int) -> None:
        self._seed = seed
        # A seed that is not a number does not change NumPy's global random state.
        options = {"popsize": candidates, "randn": self._normal, "seed": np.nan, "verbose": -9}
        self._search = cma.CMAEvolutionStrategy(start, spread, options)
        self._told: list[tuple[int, Array]] = []

    def _normal(self, *shape: int) -> Array:
        return self._rng.normal(size=shape)

    @property
    def mean(self) -> Array:
        """The best guess so far (size,)."""
        mean: Array = self._search.mean
        return mean

    @property
    def spread(self) -> float:
        """Standard deviation of the candidates, over all directions."""
        return float(self._search.sigma)

    def ask(self, steps: int) -> Array:
        """Candidates (c, size) of a generation; ``steps`` counts the environment steps taken before."""
        self._steps, self._rng = steps, np.random.default_rng([self._seed, steps])
        self._candidates = self._search.ask()
        return np.array(self._candidates)

    def tell(self, score: Array) -> None:
        """Moves the mean by the scores (c,) of the last candidates; only their ranks count."""
        self._told.append((self._steps, score))
        self._search.tell(self._candidates, list(-score))

    def state_dict(self) -> dict[str, Any]:
        """Steps and scores of all generations so far."""
        steps, scores = zip(*self._told, strict=True) if self._told else ((), ())
        return {"steps": list(steps), "scores": torch.from_numpy(np.array(scores))}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Draws and scores the same candidates again, which leads to the same search bit for bit."""
        for steps, score in zip(state["steps"], state["scores"].numpy(), strict=True):
            self.ask(steps)
            self.tell(score)
