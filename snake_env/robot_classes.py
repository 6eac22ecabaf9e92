"""Classes of robot: environment keywords under one name, from ``robot_classes.json``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from snake_env import _checks

FILE = Path(__file__).with_suffix(".json")


@cache
def load() -> dict[str, dict[str, Any]]:
    """Each class: ``about``; ``parts``, each with what it is, its source and its keywords; and ``judged``, keywords of
    evaluations in the class.
    """
    classes: dict[str, dict[str, Any]] = json.loads(FILE.read_text())
    return classes


def of(name: Any) -> dict[str, Any]:
    """The class of this name.

    Raises:
        ConfigError: there is none.
    """
    return load()[_checks.choice("robot_class", name, list(load()))]


def keywords(name: str) -> dict[str, Any]:
    """Of an environment in a class, as JSON has them.

    Raises:
        ConfigError: there is no such class.
    """
    found: dict[str, Any] = {}
    for part in of(name)["parts"]:
        found = over(found, part["options"])
    return found


def over(base: Mapping[str, Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Keywords on top of others; where both are mappings, their fields."""
    both = dict(base)
    for name, value in options.items():
        own = both.get(name)
        both[name] = {**own, **value} if isinstance(own, Mapping) and isinstance(value, Mapping) else value
    return both


def split(options: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float]]:
    """Keywords of an environment, those of its ``robot_class`` beneath them; and the noise that the class has on blocks
    of the observation, which may not be there.

    Raises:
        ConfigError: there is no such class.
    """
    rest = dict(options)
    if (name := rest.pop("robot_class", None)) is None:
        return rest, {}
    own = keywords(name)
    noise = own.pop("observation_noise", {})
    return over(own, rest), noise
