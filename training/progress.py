"""Evaluation during training: the policy without exploration on validation fields; the best one is kept."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from snake_env._files import write_text
from snake_env.evaluation import rollout, seeds
from snake_env.policies.interface import Policy
from training.config import RunConfig

SKIP = 200_000
"""Validation seeds before this one are for scripted controllers and for comparing the seeds of a configuration."""

SHOWN = ("is_success", "speed", "return")


class Progress:
    """Plays policies of one run and keeps their scores; the one of the highest :func:`merit` is the best.

    Args:
        run: Folder, with the file ``evaluations.jsonl``.
        config: Of the run.
        steps: Environment steps taken before; what an earlier part of the run noted beyond them is dropped.
    """

    def __init__(self, run: Path, config: RunConfig, steps: int) -> None:
        self._file = run / "evaluations.jsonl"
        self._config = config
        rows = [json.loads(line) for line in self._file.read_text().splitlines()] if self._file.exists() else []
        self._rows = [row for row in rows if row["steps"] <= steps]

    def play(self, policy: Policy, steps: int) -> dict[str, float]:
        """Scores of a policy after so many environment steps, also noted in the file."""
        fields = seeds.selection(self._config.evaluation_fields, SKIP)
        found, of_tasks = means_over_tasks(policy, self._config, fields, SHOWN)
        row = {"steps": steps} | {key: round(mean, 4) for key, mean in found.items()}
        if len(of_tasks) > 1:
            row |= {f"{key}/{task}": round(means[key], 4) for task, means in of_tasks.items() for key in SHOWN[:2]}
        self._rows = [one for one in self._rows if one["steps"] < steps] + [row]
        write_text(self._file, "".join(json.dumps(one) + "\n" for one in self._rows))
        return row

    @property
    def last_is_best(self) -> bool:
        """Whether none played before is better than the policy that has just played."""
        return bool(self._rows) and all(merit(self._rows[-1]) >= merit(row) for row in self._rows)


def merit(row: Mapping[str, Any]) -> float:
    """Success rate plus speed [m/s], by which policies of a task are compared; zero before an episode has ended."""
    return float(row.get("is_success", 0.0) + row.get("speed", 0.0))


def means_over_tasks(
    policy: Policy, config: RunConfig, fields: list[int], signals: Sequence[str]
) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
    """Means of signals of the episodes of a policy in the tasks of a run: over the tasks, and over the fields of each.

    Args:
        policy: Plays.
        config: Of the run.
        fields: Seeds, one per episode in each task.
        signals: Names.
    """
    of_tasks: dict[str, dict[str, float]] = {}
    for task, env_id, options in config.environments():
        episodes = rollout.run_episodes(policy, env_id, fields, config.num_threads, **options)
        of_tasks[task] = {name: float(episodes[name].mean()) for name in signals}
    return {name: float(np.mean([means[name] for means in of_tasks.values()])) for name in signals}, of_tasks
