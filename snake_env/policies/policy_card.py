"""What a trained policy is and how it scored: ``policy.card``."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from snake_env import _checks, _documents
from snake_env._cli import wrapped
from snake_env.errors import ConfigError
from snake_env.markdown import table

Estimates = dict[str, tuple[float | None, float | None, float | None]]
"""Score by name: value, low and high end of its 95 % bootstrap interval; None where there is no value."""


KINDS: dict[str, tuple[Any, str]] = {
    "about": (str, "a text"),
    "env_id": (str, "the id of an environment"),
    "env_options": (dict, "a mapping of keywords to values"),
    "steps": (int | None, "an integer"),
    "training": (str, "a text"),
    "scored_in": (dict, "a mapping of keywords to values"),
    "scores": (dict, "a mapping of names to [value, low, high]"),
    "scenes": (int, "an integer"),
    "versions": (dict, "a mapping of packages to versions"),
    "notes": (list, "a list of texts"),
    "license": (str, "a text"),
}
"""Of the parts of a card in a file."""


@dataclass(frozen=True)
class PolicyCard:
    """What a policy is, where it was trained and how it scored.

    Attributes:
        name: of the policy.
        about: one line.
        env_id: Environment of its training; None if unknown.
        env_options: Keywords of that environment, those that belong to the policy among them.
        steps: Environment steps of the last stage of training; None if unknown.
        training: The command that repeats the training, or what is known about it.
        scored_in: Keywords on top of ``env_options`` for the scores, such as another difficulty or goal.
        scores: On test scenes of ``env_id`` with ``scored_options``; empty if it has not been scored.
        scenes: Number of test scenes, one episode each.
        versions: of the packages that the scores were computed with.
        notes: Facts that limit the use of the scores.
        license: of the weights.
    """

    name: str
    about: str = ""
    env_id: str | None = None
    env_options: dict[str, Any] = field(default_factory=dict)
    steps: int | None = None
    training: str = ""
    scored_in: dict[str, Any] = field(default_factory=dict)
    scores: Estimates = field(default_factory=dict)
    scenes: int = 0
    versions: dict[str, str | None] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    license: str = ""

    @classmethod
    def of(cls, name: str, config: dict[str, Any], beside: Path) -> PolicyCard:
        """The card of a policy: the configuration in its file, and the JSON file of its scores if there is one.

        Args:
            name: of the policy.
            config: from the metadata of its file.
            beside: JSON file with further attributes.

        Raises:
            ConfigError: names the attribute that is not admissible.
        """
        known = {
            "about": config.get("about", ""),
            "env_options": config.get("env", {}),
            "steps": config.get("steps"),
        }
        if "env_id" in config:
            known["env_id"] = config["env_id"]
        if beside.exists():
            known |= _read(beside)
        for part, value in known.items():
            if part not in KINDS:
                raise ConfigError(f"card.{part}", repr(value), f"one of {', '.join(KINDS)}")
            _checks.kind(f"card.{part}", value, *KINDS[part])
        scores = {key: _estimate(key, value) for key, value in known.get("scores", {}).items()}
        notes = tuple(_checks.kind("card.notes", note, str, "texts") for note in known.get("notes", []))
        return cls(name=name, **known | {"scores": scores, "notes": notes})

    @property
    def scored_options(self) -> dict[str, Any]:
        """Keywords of the environment of the scores."""
        return self.env_options | self.scored_in

    def __str__(self) -> str:
        """The card in Markdown."""
        facts = [
            ("environment", f"`{self.env_id}`" if self.env_id else "unknown"),
            ("keywords", f"`{json.dumps(self.env_options)}`"),
            *([("scored with", f"`{json.dumps(self.scored_in)}`")] if self.scored_in else []),
            ("training", self.training or "unknown"),
            ("environment steps of the last stage", f"{self.steps:,}" if self.steps else "unknown"),
            ("versions", ", ".join(f"{name} {version}" for name, version in self.versions.items()) or "unknown"),
            ("licence", self.license or "unknown"),
        ]
        listed = "\n".join(wrapped(f"* {name}: {value}", "  ") for name, value in facts)
        parts = [f"# {self.name}", wrapped(self.about), listed]
        if self.scores:
            rows = [(name, *("-" if v is None else f"{v:.3f}" for v in values)) for name, values in self.scores.items()]
            parts += [f"{self.scenes} test scenes, 95 % intervals:", table(("score", "value", "low", "high"), rows)]
        return "\n\n".join([part.strip() for part in (*parts, *map(wrapped, self.notes)) if part]) + "\n"


def _read(path: Path) -> dict[str, Any]:
    try:
        found = _documents.read(path)
    except (OSError, ValueError) as error:
        raise ConfigError("card", str(path), f"a JSON file ({error})") from None
    card: dict[str, Any] = _checks.kind("card", found, dict, "a mapping")
    return card


def _estimate(name: str, value: Any) -> tuple[float | None, float | None, float | None]:
    if not isinstance(value, list) or len(value) != 3:
        raise ConfigError(f"card.scores.{name}", repr(value), "[value, low, high]")
    found, low, high = (None if one is None else _checks.number(f"card.scores.{name}", one) for one in value)
    return found, low, high
