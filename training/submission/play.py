"""Plays the policies of an entry."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from snake_env.evaluation import scores, seeds, tasks, tracks
from snake_env.evaluation.rollout import Episodes, layout_of
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.interface import Policy, refuse_other_interface
from snake_env.policies.loading import load_policy
from training.evaluation import cached_scores
from training.evaluation.cached_scores import Entry
from training.submission.entry import Scores, Submission

CACHE = Path("runs/submissions")
"""Folder of the episodes that have been played."""


def actor(policy: str, task: BenchmarkTask, env_options: dict[str, Any]) -> Policy:
    """Who acts in a task; a scripted controller as tuned for it."""
    found: Policy = load_policy(policy, task=task.name, env_options=env_options)
    refuse_other_interface(found, task.options)
    return found


def task_of(name: str, robot_class: str) -> BenchmarkTask:
    """A task of the benchmark in a class of robot, as it is judged."""
    (task,) = tasks.chosen([name])
    return tasks.judged(task, robot_class)


def observed(policy: str, chosen: Sequence[BenchmarkTask], env_options: dict[str, Any]) -> list[str]:
    """The blocks that a policy observes in any of the tasks."""
    found: dict[str, None] = {}
    for task in chosen:
        options = task.options | actor(policy, task, env_options).env_options
        found |= dict.fromkeys(tracks.observed(layout_of(task.env_id, options)))
    return list(found)


def episodes(
    policy: str,
    submission: Submission,
    task: BenchmarkTask,
    count: int,
    first: int,
    num_threads: int | None,
) -> Episodes:
    """Of a policy on test scenes; what has been played is kept."""
    tracks.require(submission.track, observed(policy, [task], submission.env_options))
    path = Path(policy)
    content = path.read_bytes() if path.is_file() else f"{policy} {cached_scores.tuning(policy, task)}".encode()
    known_by = content + str(submission.env_options).encode()
    entry = Entry(policy, lambda one: actor(policy, one, submission.env_options), lambda one: known_by)
    return cached_scores.Bench(CACHE, seeds.held_out(count, first), num_threads).episodes(task, entry)


def summary(found: Episodes) -> Scores:
    """What an entry has of the episodes of a run in a task."""
    row, speed = scores.score(found), found["speed"].astype(np.float64)
    cost, free = row["cost_of_transport"].value, row["contact_free"].value
    return Scores(
        success=row["success"].value,
        speed=row["speed"].value,
        speed_deviation=float(speed.std(ddof=1)) if len(speed) > 1 else 0.0,
        score=float(np.where(found["is_success"], speed, 0.0).mean()),
        chatter=row["chatter"].value,
        cost_of_transport=cost if np.isfinite(cost) else None,
        contact_free=free if 0.0 <= free <= 1.0 else None,  # what is neither is no share: hardly any progress
        failed=int((found["diverged"] | found["penetrated"]).sum()),
    )
