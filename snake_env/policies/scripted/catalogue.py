"""The scripted controllers by name, and the numbers that tuning has chosen for each task."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from snake_env.errors import ConfigError
from snake_env.policies.scripted.controller import Controller
from snake_env.policies.scripted.follow import FollowTheLeader
from snake_env.policies.scripted.gaits import HeadingGait, TaperedGait
from snake_env.policies.scripted.jam import JamResolving
from snake_env.policies.scripted.reflex import ContactReflex

CONTROLLERS: dict[str, type[Controller]] = {
    kind.title: kind for kind in (TaperedGait, HeadingGait, JamResolving, ContactReflex, FollowTheLeader)
}

TUNED = Path(__file__).parent / "tuned.json"
"""By task and controller: the parameters, and on how many scenes they were chosen, which `python -m training tune`
writes; or, under ``tuned_for``, another task whose parameters the controller has here too."""

HARDEST = ("field-hard", "field-solvable")
"""Tasks in one of which every controller is tuned."""


def read(path: Path = TUNED) -> dict[str, Any]:
    """What has been tuned so far."""
    return json.loads(path.read_text()) if path.exists() else {}


def chosen(title: str, task: str, path: Path = TUNED) -> dict[str, Any] | None:
    """What tuning has chosen for a controller in a task, or in the task that the file names instead; None: nothing."""
    content = read(path)
    found: dict[str, Any] | None = content.get(task, {}).get(title)
    return content[found["tuned_for"]][title] if found and "tuned_for" in found else found


def tuned(title: str, task: str | None = None, path: Path = TUNED) -> Controller:
    """A controller with the numbers chosen for a task.

    Args:
        title: of the controller.
        task: None: the hardest one that it was tuned for, in the order of :data:`HARDEST`.
        path: of the numbers.

    Raises:
        ConfigError: the controller does not exist, or has no numbers for the task.
    """
    controller = kind(title)
    task = task or next(one for one in HARDEST if chosen(title, one, path))
    found = chosen(title, task, path)
    if found is None:
        expected = f"one tuned for {task}: {_typed(read(path).get(task, {})) or 'none is'}"
        raise ConfigError("policy", title, expected)
    return controller(found["values"])


def _typed(titles: Iterable[str]) -> str:
    """Names of controllers as they are typed."""
    return ", ".join(title.replace(" ", "-") for title in titles)


def kind(title: str) -> type[Controller]:
    """The controller of this name, with spaces or hyphens.

    Raises:
        ConfigError: it does not exist.
    """
    if title.replace("-", " ") not in CONTROLLERS:
        raise ConfigError("policy", title, f"one of {_typed(CONTROLLERS)}")
    return CONTROLLERS[title.replace("-", " ")]
