"""Statistics over episodes and over seeds: bootstrap and Student intervals, aggregates of Agarwal et al. (2021).

The aggregates are defined as in rliable; the package itself is not used, since it brings arch, statsmodels and seaborn
along for four short formulas.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras

with extras():
    from scipy import stats

Array = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 2000


class Estimate(NamedTuple):
    """A value and its 95 % confidence interval."""

    value: float
    low: float
    high: float


def bootstrap(
    statistic: Callable[..., Any], *samples: Any, paired: bool = False, resamples: int = RESAMPLES
) -> Estimate:
    """Percentile bootstrap of a statistic.

    Args:
        statistic: Of the samples, with keyword ``axis``.
        *samples: (n,) each. Unpaired samples are drawn again one by one: a stratified bootstrap.
        paired: The samples have one entry per episode and are drawn again together.
        resamples: Number of resamples.
    """
    data = [np.asarray(one, np.float64) for one in samples]
    if min(len(one) for one in data) == 0:
        return Estimate(np.nan, np.nan, np.nan)
    value = float(statistic(*data, axis=-1))
    if min(len(one) for one in data) == 1:
        return Estimate(value, value, value)
    with np.errstate(invalid="ignore"):  # of infinite values; the percentiles below have no need of differences
        found = stats.bootstrap(
            data, statistic, n_resamples=resamples, paired=paired, method="percentile", rng=np.random.default_rng(0)
        )
    return Estimate(value, *_ends(found.bootstrap_distribution))


def _ends(distribution: Any) -> tuple[float, float]:
    """Of the interval that holds the middle part of a bootstrap distribution."""
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(distribution, [tail, 100.0 - tail], method="closest_observation")
    return float(low), float(high)


def mean_interval(values: Any) -> Estimate:
    """Mean over episodes."""
    return bootstrap(np.mean, values)


def ratio_interval(numerator: Any, denominator: Any) -> Estimate:
    """Ratio of sums over episodes, e.g. energy over distance; infinite where the denominator is not positive."""
    return bootstrap(_ratio, numerator, denominator, paired=True)


def _ratio(numerator: Array, denominator: Array, axis: int) -> Any:
    above, below = numerator.sum(axis=axis), denominator.sum(axis=axis)
    return np.where(below > 0.0, above / np.where(below > 0.0, below, 1.0), np.inf)


def paired_difference(values: Any, reference: Any) -> Estimate:
    """Mean difference, episode by episode."""
    return mean_interval(np.asarray(values, np.float64) - np.asarray(reference, np.float64))


def student_interval(values: Sequence[float], least: float = -np.inf, most: float = np.inf) -> Estimate:
    """Mean over a few runs with Student's interval, which is not a number for fewer than two.

    Args:
        values: of the runs.
        least: that a mean can be; the interval ends there.
        most: likewise.
    """
    if len(values) < 2:
        return Estimate(float(np.mean(values)), np.nan, np.nan)
    mean, error = float(np.mean(values)), float(stats.sem(values))
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(values) - 1)) * error
    return Estimate(mean, max(mean - half, least), min(mean + half, most))


def interquartile_mean(*tasks: Any) -> Estimate:
    """Mean of the middle half of the scores of all runs in all tasks, (runs,) each; stratified bootstrap over runs."""
    return bootstrap(lambda *runs, axis: stats.trim_mean(np.concatenate(runs, axis=axis), 0.25, axis=axis), *tasks)


def probability_of_improvement(scores: Sequence[Any], reference: Sequence[Any]) -> Estimate:
    """Probability that a run scores higher than one of the reference in the same task; ties count half.

    Args:
        scores: by task (runs,); tasks count alike.
        reference: in the same tasks.
    """

    def mean_over_tasks(*runs: Array, axis: int) -> Any:
        pairs = zip(runs[: len(scores)], runs[len(scores) :], strict=True)
        return np.mean([_superiority(ours, theirs, axis) for ours, theirs in pairs], axis=0)

    return bootstrap(mean_over_tasks, *scores, *reference)


def _superiority(scores: Array, reference: Array, axis: int) -> Any:
    """The statistic of Mann and Whitney over the number of pairs."""
    ours, theirs = scores.shape[axis], reference.shape[axis]
    ranks = stats.rankdata(np.concatenate([scores, reference], axis=axis), axis=axis)
    above = np.take(ranks, range(ours), axis=axis).sum(axis=axis) - 0.5 * ours * (ours + 1)
    return above / (ours * theirs)
