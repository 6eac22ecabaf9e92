"""The scripted controllers by name, and the numbers that tuning has chosen for each task."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from snake_env import ConfigError
from training.policies.scripted.controller import Controller
from training.policies.scripted.follow import FollowTheLeader
from training.policies.scripted.gaits import HeadingGait, TaperedGait
from training.policies.scripted.jam import JamResolving
from training.policies.scripted.reflex import ContactReflex

CONTROLLERS: dict[str, type[Controller]] = {
    kind.title: kind for kind in (TaperedGait, HeadingGait, JamResolving, ContactReflex, FollowTheLeader)
}

TUNED = Path(__file__).parent / "tuned.json"
"""By task and controller: the parameters, and on how many fields they were chosen. `training.search.tune` writes it."""


def read(path: Path = TUNED) -> dict[str, Any]:
    """What has been tuned so far."""
    return json.loads(path.read_text()) if path.exists() else {}


def tuned(title: str, task: str, path: Path = TUNED) -> Controller:
    """A controller with the numbers chosen for a task.

    Raises:
        ConfigError: the controller does not exist, or has not been tuned for the task.
    """
    controller = kind(title)
    try:
        values = read(path)[task][title]["values"]
    except KeyError:
        expected = f"one tuned for {task}; run python -m training.search.tune --tasks {task}"
        raise ConfigError("policy", title, expected) from None
    return controller(values)


def kind(title: str) -> type[Controller]:
    """The controller of this name.

    Raises:
        ConfigError: it does not exist.
    """
    if title not in CONTROLLERS:
        raise ConfigError("policy", title, f"one of {', '.join(CONTROLLERS)}")
    return CONTROLLERS[title]
