"""Scores of one policy in one task, played once and cached."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from joblib import Memory

import snake_env
from snake_env import ConfigError, _native
from snake_env.evaluation import rollout
from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.gaits import DEGREE, GaitParameters, GaitPolicy
from snake_env.policies.interface import Policy
from snake_env.policies.loading import load_policy
from snake_env.policies.scripted import catalogue
from training.config import ROOT
from training.config_file import CONFIGS
from training.evaluation.loading import trained_with

CONFIG = CONFIGS / "benchmark.json"

KEPT = (
    "is_success",
    "distance",
    "speed",
    "time",
    "jam_ratio",
    "mean_self_contact_force",
    "cost_of_transport",
    "left_corridor",
    "diverged",
    "penetrated",
)
"""Signals of an episode's last step that are kept."""


@dataclass(frozen=True)
class Entry:
    """A row of the tables.

    Args:
        name: in tables.
        make: the policy for a task.
        plays: Whether it is in a task's table.
        source: File or class it is made from, whose bytes identify the policy.
    """

    name: str
    make: Callable[[BenchmarkTask], Policy]
    plays: Callable[[BenchmarkTask], bool]
    source: Callable[[BenchmarkTask], bytes]


def entries(config: Path, chosen: Sequence[str] | None, more: list[tuple[str, Path]]) -> list[Entry]:
    """The configuration's scripted and trained policies, only those in ``chosen`` if given, and ``more`` files.

    Raises:
        ConfigError: a chosen name that the configuration does not have, or two policies of one name.
    """
    content = json.loads(config.read_text())
    found = [scripted(name) for name in content["scripted"]]
    found += [constant(one["name"], one["degrees"], one["tasks"]) for one in content["gaits"]]
    found += [trained(one["name"], ROOT / one["path"], one.get("tasks")) for one in content["trained"]]
    known = [one.name for one in found]
    for name in chosen or []:
        if name not in known:
            raise ConfigError("policy", name, f"one of {', '.join(known)}")
    kept = [one for one in found if chosen is None or one.name in chosen]
    for name, path in more:
        if name in [one.name for one in kept]:
            raise ConfigError("policy", f"{name} ({path})", "a name of its own, as in NAME=PATH")
        kept.append(trained(name, path, None))
    return kept


def scripted(name: str) -> Entry:
    """The thesis's gait, or a controller as tuned for the task."""
    if name == "thesis gait":
        return Entry(name, thesis_gait, lambda task: True, lambda task: b"")
    return Entry(
        name,
        lambda task: catalogue.tuned(name, task.name),
        lambda task: catalogue.chosen(name, task.name) is not None,
        lambda task: json.dumps(catalogue.chosen(name, task.name)).encode(),
    )


def thesis_gait(task: BenchmarkTask) -> Policy:
    """The thesis's gait, the same in every task."""
    return GaitPolicy(GaitParameters())


def constant(name: str, degrees: dict[str, float], of_tasks: Sequence[str]) -> Entry:
    """A gait that never changes, by its parameters [deg], [deg/s]."""
    wave = GaitParameters(**{key: value * DEGREE for key, value in degrees.items()})
    return Entry(
        name,
        lambda task: GaitPolicy(wave, name),
        lambda task: task.name in of_tasks,
        lambda task: json.dumps(degrees).encode(),
    )


def trained(name: str, path: Path, of_tasks: Sequence[str] | None) -> Entry:
    """A policy from a file, with the interface it was trained with and the task's difficulty.

    Without ``of_tasks`` it plays in all tasks of the model that it was trained with.
    """
    return Entry(
        name,
        lambda task: load_policy(path, name=name),
        lambda task: task.model == trained_with(path) if of_tasks is None else task.name in of_tasks,
        lambda task: path.read_bytes(),
    )


def scores(out: Path, task: BenchmarkTask, entry: Entry, fields: list[int], num_threads: int | None) -> Episodes:
    """The first episode of each field, played unless the same policy, task, fields and code have been before.

    Args:
        out: Folder of the cache.
        task: Environment.
        entry: Policy.
        fields: Seeds, one per episode.
        num_threads: Threads of the simulator.
    """
    memory = Memory(out / "cache", verbose=0)
    play = memory.cache(_play, ignore=["entry", "task", "num_threads"])
    known_by = (task.env_id, task.options, entry.name, entry.source(task))
    episodes: Episodes = play(entry, task, fields, num_threads, known_by, code())
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
