"""Scores of one policy in one task, played once and cached."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Memory

import snake_env
from snake_env import _native
from snake_env.evaluation import rollout, seeds
from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.interface import Policy
from snake_env.policies.loading import load_policy
from snake_env.policies.scripted import catalogue
from training.config import ROOT

KEPT = (
    "is_success",
    "distance",
    "speed",
    "time",
    "jam_ratio",
    "mean_self_contact_force",
    "cost_of_transport",
    "left_corridor",
    "contact_free_progress",
    "chatter",
    "diverged",
    "penetrated",
)
"""Signals of an episode's last step that are kept."""


@dataclass(frozen=True)
class Entry:
    """A policy.

    Args:
        name: in tables.
        make: the policy for a task.
        source: File or numbers it is made from, which identify the policy.
    """

    name: str
    make: Callable[[BenchmarkTask], Policy]
    source: Callable[[BenchmarkTask], bytes]


def tuning(name: str, task: BenchmarkTask) -> dict[str, Any] | None:
    """The numbers of a scripted controller in a task; None: it was not tuned there, or is another policy."""
    return catalogue.chosen(name.replace("-", " "), task.name)


def trained(name: str, path: Path) -> Entry:
    """A policy from a file, with the interface it was trained with and the task's difficulty."""
    return Entry(name, lambda task: load_policy(path, name=name), lambda task: path.read_bytes())


@dataclass(frozen=True)
class Bench:
    """Plays policies in tasks, or takes their episodes from the cache.

    Args:
        out: folder.
        fields: seeds, one per episode; all of them held out.
        num_threads: threads of the simulator.
    """

    out: Path
    fields: list[int]
    num_threads: int | None = None

    def __post_init__(self) -> None:
        seeds.require_held_out(self.fields)

    def episodes(self, task: BenchmarkTask, entry: Entry) -> Episodes:
        """The first episode of each field, played unless the same policy, task, fields and code have been before."""
        memory = Memory(self.out / "cache", verbose=0)
        play = memory.cache(_play, ignore=["entry", "task", "num_threads"])
        known_by = (task.env_id, task.options, entry.name, entry.source(task))
        episodes: Episodes = play(entry, task, self.fields, self.num_threads, known_by, code())
        return episodes


def _play(
    entry: Entry, task: BenchmarkTask, fields: list[int], num_threads: int | None, known_by: object, code: str
) -> Episodes:
    """``known_by`` and ``code`` are keys of the cache only."""
    episodes = rollout.run_episodes(entry.make(task), task.env_id, fields, num_threads, **task.options)
    return {name: episodes[name] for name in KEPT}


def code() -> str:
    """A digest of the simulator and of the code that acts."""
    parts = [Path(str(_native.__file__)).read_bytes(), *(file.read_bytes() for file in sources())]
    return hashlib.sha256(b"".join(hashlib.sha256(part).digest() for part in parts)).hexdigest()


def sources() -> list[Path]:
    """The code of the environments, whose ids and defaults make the task, and that which acts for policies."""
    package = Path(snake_env.__file__).parent
    environments = [*package.glob("*.py"), *(package / "config").glob("*.py")]
    acting = [package / "evaluation/rollout.py", *(package / "policies").rglob("*.py")]
    return sorted(environments) + sorted([*acting, *(ROOT / "training/policies").rglob("*.py")])
