"""Bootstrap confidence intervals over episodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Estimate(NamedTuple):
    """A value and its 95 % confidence interval."""

    value: float
    low: float
    high: float


def bootstrap(
    statistic: Callable[[Array], Array],
    episodes: Array,
    resamples: int = 2000,
    confidence: float = 0.95,
    seed: int = 0,
) -> Estimate:
    """Percentile bootstrap: the spread of a statistic over episodes drawn again with replacement.

    Args:
        statistic: maps rows (..., n, columns) to values (...).
        episodes: (n,) or (n, columns), one row an episode.
        resamples: number of resamples.
        confidence: coverage of the interval, in (0, 1).
        seed: of the resampling.
    """
    if not len(episodes):
        return Estimate(np.nan, np.nan, np.nan)
    rows = episodes.reshape(len(episodes), -1)
    draws = np.random.default_rng(seed).integers(len(rows), size=(resamples, len(rows)))
    values = statistic(rows[draws])
    tail = 50.0 * (1.0 - confidence)
    low, high = np.percentile(values, [tail, 100.0 - tail], method="closest_observation")
    return Estimate(float(statistic(rows[None])[0]), float(low), float(high))


def mean(rows: Array) -> Array:
    """Mean of the first column."""
    return rows[..., 0].mean(axis=-1)


def ratio(rows: Array) -> Array:
    """Sum of the first column over sum of the second; infinite where the second sum is not positive."""
    above, below = rows[..., 0].sum(axis=-1), rows[..., 1].sum(axis=-1)
    return np.where(below > 0.0, above / np.where(below > 0.0, below, 1.0), np.inf)


def mean_interval(values: Array) -> Estimate:
    """Mean over episodes."""
    return bootstrap(mean, np.asarray(values, np.float64))


def ratio_interval(numerator: Array, denominator: Array) -> Estimate:
    """Ratio of sums over episodes, e.g. energy over distance."""
    return bootstrap(ratio, np.stack([numerator, denominator], axis=-1).astype(np.float64))


def paired_difference(values: Array, reference: Array) -> Estimate:
    """Mean of ``values - reference``, episode by episode on the same fields."""
    return mean_interval(np.asarray(values, np.float64) - np.asarray(reference, np.float64))
