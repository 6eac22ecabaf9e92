"""Policies from files, and whether they fit an environment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from snake_env import ConfigError
from snake_env.evaluation.tasks import model_of
from snake_env.policies.interface import INTERFACE, Policy, named_task, title
from snake_env.policies.loading import load_policy
from snake_env.registration import TASKS


def load_models(paths: list[Path]) -> list[Policy]:
    """Trained policies; those that would have one name are named by their paths."""
    titles = [title(path) for path in paths]
    return [load_policy(path, name=str(path) if titles.count(title(path)) > 1 else None) for path in paths]


def task(env_id: str | None, options: dict[str, Any], paths: list[Path]) -> tuple[str, dict[str, Any]]:
    """Environment and keywords: those of the first policy's training, overridden by those given."""
    if env_id is not None or not paths:
        return env_id or "SnakeField-v1", options
    env_id, keywords = named_task(*_origin(paths[0]))
    of_task = {name: value for name, value in keywords.items() if name not in INTERFACE}
    return env_id, of_task | options


def _origin(path: Path) -> tuple[str, dict[str, Any]]:
    """Environment and keywords of the run that a policy comes from; a zip on its own is taken to be of random fields.

    Raises:
        ConfigError: the file cannot be read, or does not name them.
    """
    card = getattr(load_policy(path), "card", None)
    if card is None or (path.suffix != ".zip" and card.env_id is None):
        raise ConfigError("policy", path, "a file with the configuration of its run, env_id and env, as metadata")
    return card.env_id or "SnakeField-v1", card.env_options


def trained_with(path: Path) -> str:
    """The robot's model with which a policy was trained."""
    env_id, options = _origin(path)
    return str(options.get("model", TASKS.get(env_id, {}).get("model", "planar")))


def refuse_other_model(paths: list[Path], env_id: str, options: dict[str, Any]) -> None:
    """Refuses to play planar policies in 3D and 3D policies in the plane; gaits play in both.

    Raises:
        ConfigError: names the model and the policy.
    """
    here = model_of(env_id, options)
    for path in paths:
        trained_in = trained_with(path)
        if trained_in != here:
            expected = f"{trained_in}, which {path} was trained in; --env and the option model choose it"
            raise ConfigError("model", here, expected)
