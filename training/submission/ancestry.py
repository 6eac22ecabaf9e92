"""Environment steps of a training and of everything that it builds on, each counted once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from snake_env.policies import files
from snake_env.policies.shipped import policy_path
from training import config_file


def steps(config: dict[str, Any]) -> int | None:
    """Steps of a run, by its configuration, and of its ancestors; None: those of one are unknown.

    Ancestors are the policies and runs whose weights it takes over, and its teachers; scripted ones have no steps.
    """
    own = config.get("steps", config.get("total_steps"))
    try:
        counts: list[Any] = [own, *ancestors(config).values()]
    except (OSError, ValueError):  # a file that is not here
        return None
    return None if None in counts else sum(counts)


def ancestors(config: dict[str, Any]) -> dict[str, int | None]:
    """Steps of each ancestor alone, by name."""
    cloning = config.get("behaviour_cloning") or {}
    named = {one for one in (cloning.get("policy"), *(cloning.get("teachers") or {}).values()) if one}
    found: dict[str, int | None] = {}
    for name, parent in [
        *((name, files.read(policy_path(Path(name)))[1]) for name in sorted(named)),
        *((name, config_file.read(name)) for name in [cloning.get("run")] if name),
    ]:
        found |= ancestors(parent) | {name: parent.get("steps", parent.get("total_steps"))}
    return found
