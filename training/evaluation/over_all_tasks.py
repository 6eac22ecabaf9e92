"""The policies that play in every planar task, over all of them: the aggregates of Agarwal et al. (2021).

An episode stands for their run: the benchmark plays one policy in many scenes, not many trainings of it. Its score is
its speed [m/s] if it reaches the goal, else zero, which needs no scale per task: distance and time limit are the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.scores import cell
from snake_env.evaluation.statistics import (
    Estimate,
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
)
from snake_env.markdown import table

FASTER = (0.0, 0.1, 0.2, 0.3, 0.4)
"""Speeds [m/s] at which the JSON file has the profile; above zero is success."""

PROFILE = tuple(round(0.025 * k, 3) for k in range(25))
"""Speeds [m/s] of the performance profile."""

TEXT = """The {count} policies that play in every planar task. The score of an episode is its speed if it reaches the
goal, else zero. Interquartile mean, performance profile (share of episodes above a score) and probability of
improvement are those of Agarwal et al. (2021). Intervals are of the bootstrap over scenes, stratified by task.
"""


@dataclass(frozen=True)
class Overall:
    """A policy over all tasks.

    Attributes:
        middle: interquartile mean of the scores [m/s].
        profile: by speed [m/s] the share of the episodes that score higher; at zero the success rate.
        beaten: probability that an episode of the best policy in the same task scores higher; the best has none.
    """

    middle: Estimate
    profile: dict[float, Estimate]
    beaten: Estimate | None


def score(episodes: Episodes) -> NDArray[np.float64]:
    """Of each episode (n,) [m/s]."""
    return np.where(episodes["is_success"], episodes["speed"], 0.0)


def over_all(played: dict[str, dict[str, Episodes]]) -> dict[str, Overall]:
    """The policies that play in every task, from their episodes by task and policy."""
    first, *others = played.values()
    scores = {
        name: [score(of_task[name]) for of_task in played.values()]
        for name in first
        if all(name in of_task for of_task in others)
    }
    middles = {name: interquartile_mean(*of_tasks) for name, of_tasks in scores.items()}
    best = max(middles, key=lambda name: middles[name].value)
    return {
        name: Overall(
            middles[name],
            {speed: performance_profile(speed, *of_tasks) for speed in PROFILE},
            None if name == best else probability_of_improvement(scores[best], of_tasks),
        )
        for name, of_tasks in scores.items()
    }


def text(rows: dict[str, Overall], picture: str) -> str:
    """Table and picture."""
    best = next(name for name, row in rows.items() if row.beaten is None)
    heads = ["policy", "interquartile mean [m/s]", "success"]
    lines = [
        [
            name,
            cell(row.middle, 3),
            cell(row.profile[FASTER[0]], 3),
            "-" if row.beaten is None else cell(row.beaten, 3),
        ]
        for name, row in rows.items()
    ]
    shown = table([*heads, f"{best} is better with probability"], lines)
    return f"{TEXT.format(count=len(rows))}\n{shown}\n\n![performance profiles]({picture})\n"


def plain(rows: dict[str, Overall]) -> dict[str, object]:
    """For JSON."""
    return {
        name: {
            "interquartile_mean": row.middle._asdict(),
            "performance_profile": {str(speed): share._asdict() for speed, share in row.profile.items()},
            "beaten_by_the_best": None if row.beaten is None else row.beaten._asdict(),
        }
        for name, row in rows.items()
    }
