"""Policies from files and gaits, and whether they fit an environment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym

from snake_env import ConfigError
from training.config import Sb3Config
from training.policies.gaits import GaitParameters, scripted
from training.policies.interface import INTERFACE, Policy, title
from training.policies.network import Network
from training.policies.sb3_model import Model
from training.rollout import layout_of
from training.runs import RunFolder


def gait_policy(gait: GaitParameters, env_id: str, **options: Any) -> Policy:
    """A gait as a policy for an environment with these keywords, named after its parameters."""
    name = "thesis gait" if gait == GaitParameters() else str(gait)
    return scripted(gait, layout_of(env_id, options | {"action_mode": "gait"})["action"], name)


def load_model(path: Path, name: str | None = None) -> Policy:
    """A trained policy, with those keywords of its run that belong to it; named by :func:`training.policies.title`.

    Raises:
        ConfigError: there is no such file, or it is of another kind.
    """
    if not path.is_file() or path.suffix not in (".safetensors", ".zip"):
        raise ConfigError("policy", path, "the policy.safetensors or model.zip of a run")
    if path.suffix == ".safetensors":
        return Network(path, name)
    return Model(path, name or title(path), _origin(path)[1])


def load_models(paths: list[Path]) -> list[Policy]:
    """Trained policies; those that would have one name are named by their paths."""
    titles = [title(path) for path in paths]
    return [load_model(path, str(path) if titles.count(title(path)) > 1 else None) for path in paths]


def task(env_id: str | None, options: dict[str, Any], paths: list[Path]) -> tuple[str, dict[str, Any]]:
    """Environment and keywords: those asked for, over those that the first policy was trained with."""
    if env_id is not None or not paths:
        return env_id or "SnakeField-v0", options
    env_id, trained_with = _origin(paths[0])
    of_task = {name: value for name, value in trained_with.items() if name not in INTERFACE}
    return env_id, of_task | options


def _origin(path: Path) -> tuple[str, dict[str, Any]]:
    """Environment and keywords of the run that a policy comes from."""
    if path.suffix == ".safetensors":
        found = Network(path).config
        return found["env_id"], found["env"]
    folder = RunFolder(path.parent)
    config = folder.config() if folder.exists else Sb3Config()
    return config.env_id, config.env


def refuse_other_interface(policy: Policy, options: dict[str, Any]) -> None:
    """Refuses keywords of the environment that a policy brings along and that were asked for otherwise.

    Raises:
        ConfigError: names the keyword.
    """
    for name in INTERFACE:
        own = policy.env_options.get(name)
        if own is not None and options.get(name, own) != own:
            raise ConfigError(f"options.{name}", options[name], f"{own}, which {policy.name} acts with")


def refuse_other_model(paths: list[Path], env_id: str, options: dict[str, Any]) -> None:
    """Refuses to play policies of the plane in space, and the other way round; gaits play in both.

    Raises:
        ConfigError: names the model and the policy.
    """
    here = _model(env_id, options)
    for path in paths:
        trained_in = _model(*_origin(path))
        if trained_in != here:
            expected = f"{trained_in}, which {path} was trained in; --env and the option model choose it"
            raise ConfigError("model", here, expected)


def _model(env_id: str, options: dict[str, Any]) -> str:
    """The robot's model in an environment with these keywords."""
    return str(options.get("model", gym.spec(env_id).kwargs.get("model", "planar")))
