"""The tasks of the benchmark: environments by name, from ``tasks.json``."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym

from snake_env.errors import ConfigError

TASKS = Path(__file__).with_name("tasks.json")
GOAL = 2.0
"""Distance of the goal by default [m]."""


@dataclass(frozen=True)
class BenchmarkTask:
    """An environment that policies are compared in.

    Args:
        name: in tables and files.
        env_id: environment.
        options: its keywords; those a policy needs, such as its action mode, come on top.
        about: one line for people.
    """

    name: str
    env_id: str
    options: dict[str, Any] = field(default_factory=dict)
    about: str = ""

    @property
    def model(self) -> str:
        """Of the robot: "planar" or "spatial"."""
        return model_of(self.env_id, self.options)


def model_of(env_id: str, options: Mapping[str, Any]) -> str:
    """The robot's model in an environment with these keywords."""
    return str(options.get("model", gym.spec(env_id).kwargs.get("model", "planar")))


def load(path: Path = TASKS) -> dict[str, BenchmarkTask]:
    """All tasks of a file, by name, in its order."""
    content = json.loads(path.read_text())
    return {
        name: BenchmarkTask(name, entry["env"], entry.get("options", {}), entry["about"])
        for name, entry in content.items()
    }


def chosen(names: Sequence[str] | None, path: Path = TASKS) -> list[BenchmarkTask]:
    """The tasks of these names; None: all.

    Raises:
        ConfigError: a name that the file does not have.
    """
    known = load(path)
    for name in names or []:
        if name not in known:
            raise ConfigError("task", name, f"one of {', '.join(known)}")
    return [known[name] for name in names or known]
