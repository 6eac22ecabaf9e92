"""Configuration files in YAML or JSON, as the values in them; nothing about what they mean."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from snake_env import ConfigError, _documents

CONFIGS = Path(__file__).parent / "configs"


def read(path: Path | str) -> dict[str, Any]:
    """The values of a configuration file, not yet checked.

    Raises:
        ConfigError: there is no such file or name, or it is not a mapping of what JSON has, each name once.
    """
    bare = [CONFIGS / f"{path}{suffix}" for suffix in (".yaml", ".json")]
    found = next((one for one in bare if os.path.exists(one)), Path(path))
    if not os.path.isfile(found):
        raise ConfigError("config", path, "a YAML or JSON file, or a name in training/configs")
    try:
        values = _documents.read(found)
    except (OSError, ValueError) as error:
        raise ConfigError("config", found, f"{_documents.notation(found)} ({error})") from None
    values = {} if values is None else values  # of an empty YAML file
    if not isinstance(values, dict):
        raise ConfigError("config", found, "a mapping of names to values")
    return values


def merged(base: Any, changes: Any) -> Any:
    """``base`` with ``changes``, mapping by mapping; None leaves a name out."""
    if not isinstance(base, dict) or not isinstance(changes, dict):
        return changes
    both = base | {name: merged(base.get(name), value) for name, value in changes.items()}
    return {name: value for name, value in both.items() if value is not None or name not in changes}
