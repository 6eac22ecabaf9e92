"""Policies from files and gaits, and whether they fit an environment."""

from __future__ import annotations

import os
import pickle
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from snake_env import ConfigError
from snake_env.evaluation.tasks import model_of
from snake_env.policies.interface import INTERFACE, Policy, named_task, title
from snake_env.policies.network import Network
from snake_env.policies.shipped import NAMES, policy_path
from snake_env.registration import TASKS
from training.config import Sb3Config
from training.policies.sb3_model import Model
from training.runs import RunFolder


def load_model(path: Path, name: str | None = None) -> Policy:
    """A trained policy, with those keywords of its run that belong to it; named by :func:`snake_env.policies.title`.

    Raises:
        ConfigError: there is no such file, or it is of another kind.
    """
    path = _file(path)
    options = _origin(path)[1] if path.suffix == ".zip" else {}
    with _readable(path):
        return Model(path, name or title(path), options) if path.suffix == ".zip" else Network(path, name)


def _file(path: Path) -> Path:
    """The file of a policy.

    Raises:
        ConfigError: there is no such file, or it is of another kind.
    """
    path = policy_path(path)
    if not os.path.isfile(path) or path.suffix not in (".safetensors", ".zip"):
        raise ConfigError("policy", path, f"one of {', '.join(NAMES)}, or {KIND}")
    return path


KIND = "the policy.safetensors or model.zip of a run"

BROKEN = (EOFError, KeyError, OSError, RuntimeError, TypeError, ValueError, pickle.UnpicklingError, zipfile.BadZipFile)
"""What readers of policy files raise about broken ones."""


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """For reading the file of a policy.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        yield
    except ConfigError:
        raise
    except BROKEN as error:
        raise ConfigError("policy", path, f"{KIND} ({' '.join(str(error).split())})") from None


def load_models(paths: list[Path]) -> list[Policy]:
    """Trained policies; those that would have one name are named by their paths."""
    titles = [title(path) for path in paths]
    return [load_model(path, str(path) if titles.count(title(path)) > 1 else None) for path in paths]


def task(env_id: str | None, options: dict[str, Any], paths: list[Path]) -> tuple[str, dict[str, Any]]:
    """Environment and keywords: those of the first policy's training, overridden by those given."""
    if env_id is not None or not paths:
        return env_id or "SnakeField-v1", options
    env_id, keywords = named_task(*_origin(paths[0]))
    of_task = {name: value for name, value in keywords.items() if name not in INTERFACE}
    return env_id, of_task | options


def _origin(path: Path) -> tuple[str, dict[str, Any]]:
    """Environment and keywords of the run that a policy comes from.

    Raises:
        ConfigError: the file cannot be read, or does not name them.
    """
    path = _file(path)
    if path.suffix == ".safetensors":
        with _readable(path):
            found = Network(path).config
        if "env_id" not in found or "env" not in found:
            raise ConfigError("policy", path, "a file with the configuration of its run, env_id and env, as metadata")
        return found["env_id"], found["env"]
    folder = RunFolder(path.parent)
    config = folder.config() if folder.exists else Sb3Config()
    return config.env_id, config.env


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
