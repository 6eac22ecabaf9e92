"""Search over a few numbers: Optuna proposes candidates, which are evaluated in batches of robots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import optuna
from numpy.typing import NDArray
from optuna.distributions import BaseDistribution, FloatDistribution
from optuna.samplers import TPESampler
from optuna.trial import FrozenTrial

from snake_env.evaluation import seeds

Values = dict[str, float]
Range = tuple[float, float]
Score = Callable[[list[Values], list[int]], NDArray[np.float64]]
"""Scores (c,) of c candidates, each on all fields of the seeds given; larger is better."""


@dataclass(frozen=True)
class Plan:
    """Size of a search.

    Args:
        batches: Batches of candidates; later batches concentrate where earlier ones scored well.
        candidates: Candidates per batch.
        fields: Fields on which each candidate plays, the same for all.
        finalists: Best candidates, which play again on other fields.
        final_fields: Fields of the finalists.
    """

    batches: int = 5
    candidates: int = 32
    fields: int = 8
    finalists: int = 6
    final_fields: int = 64

    def quick(self) -> Plan:
        """A plan of a tenth of the size."""
        return Plan(2, max(1, self.candidates // 4), max(1, self.fields // 4), 2, max(1, self.final_fields // 8))


@dataclass(frozen=True)
class Found:
    """Result of a search.

    Attributes:
        best: The candidate that scored best among the finalists.
        score: Its score on their fields.
        tried: All candidates of the batches.
        scores: Their scores (c,).
    """

    best: Values
    score: float
    tried: list[Values]
    scores: NDArray[np.float64]


def maximise(
    ranges: Mapping[str, Range],
    score: Score,
    plan: Plan,
    first: Sequence[Values] = (),
    report: Callable[[str], None] = lambda line: None,
) -> Found:
    """Searches for the best candidate with a tree-structured Parzen estimator (Bergstra et al. 2011).

    Args:
        ranges: Bounds of each number; a number whose bounds are equal is fixed.
        score: Plays candidates.
        plan: How much is tried.
        first: Candidates to try in any case, in the final too.
        report: Is given a line per batch.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    sampler = TPESampler(seed=0, multivariate=True, constant_liar=True, n_startup_trials=plan.candidates)
    study = optuna.create_study(direction="maximize", sampler=sampler)
    for values in first:
        study.enqueue_trial(values)
    space: dict[str, BaseDistribution] = {name: FloatDistribution(low, high) for name, (low, high) in ranges.items()}
    fields = seeds.selection(plan.fields)
    for number in range(plan.batches):
        trials = [study.ask(space) for _ in range(plan.candidates)]
        report(f"batch {number + 1} of {plan.batches}: {len(trials)} candidates on {len(fields)} fields each")
        for trial, value in zip(trials, score([one.params for one in trials], fields), strict=True):
            study.tell(trial, float(value))
    known, others = study.trials[: len(first)], study.trials[len(first) :]
    finalists = known + sorted(others, key=_score, reverse=True)[: plan.finalists]
    report(f"final: {len(finalists)} candidates on {plan.final_fields} other fields each")
    final = score([one.params for one in finalists], seeds.selection(plan.final_fields, plan.fields))
    best = int(np.argmax(final))
    tried = [one.params for one in study.trials]
    return Found(finalists[best].params, float(final[best]), tried, np.array([_score(one) for one in study.trials]))


def _score(trial: FrozenTrial) -> float:
    assert trial.value is not None
    return trial.value
