"""Evaluation during training: the policy without exploration on validation fields; the best one is kept."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from snake_env.evaluation import rollout, seeds
from snake_env.policies.interface import Policy
from training.config import RunConfig

SKIP = 200_000
"""Validation seeds before this one are for scripted controllers and for comparing the seeds of a configuration."""

SHOWN = ("is_success", "speed", "return")


class Progress:
    """Plays policies of one run and remembers the best.

    A policy is better if the mean over tasks of success rate plus speed [m/s] is higher.

    Args:
        run: Folder, with the file ``evaluations.jsonl``.
        config: Of the run.
        steps: Environment steps taken before; what an earlier part of the run noted beyond them is forgotten.
    """

    def __init__(self, run: Path, config: RunConfig, steps: int) -> None:
        self._file = run / "evaluations.jsonl"
        self._config = config
        rows = [json.loads(line) for line in self._file.read_text().splitlines()] if self._file.exists() else []
        self._rows = [row for row in rows if row["steps"] <= steps]

    def play(self, policy: Policy, steps: int) -> dict[str, float]:
        """Scores of a policy after so many environment steps, also noted in the file."""
        row: dict[str, float] = {"steps": steps}
        found = {name: self._scores(policy, env_id, options) for name, env_id, options in self._config.environments()}
        for key in SHOWN:
            row[key] = round(float(np.mean([scores[key] for scores in found.values()])), 4)
        if len(found) > 1:
            row |= {f"{key}/{name}": round(scores[key], 4) for name, scores in found.items() for key in SHOWN[:2]}
        self._rows = [one for one in self._rows if one["steps"] < steps] + [row]
        self._file.write_text("".join(json.dumps(one) + "\n" for one in self._rows))
        return row

    def _scores(self, policy: Policy, env_id: str, options: dict[str, Any]) -> dict[str, float]:
        fields = seeds.selection(self._config.evaluation_fields, SKIP)
        episodes = rollout.run_episodes(policy, env_id, fields, self._config.num_threads, **options)
        return {key: float(episodes[key].mean()) for key in SHOWN}

    @property
    def last_is_best(self) -> bool:
        """Whether none played before is better than the policy that has just played."""
        return bool(self._rows) and all(_merit(self._rows[-1]) >= _merit(row) for row in self._rows)


def _merit(row: Mapping[str, float]) -> float:
    return row["is_success"] + row["speed"]
