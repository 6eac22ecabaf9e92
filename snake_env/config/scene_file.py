"""Scenes as files: JSON, and YAML where PyYAML is installed."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from snake_env import _documents
from snake_env._documents import YAML, notation
from snake_env._extras import extras
from snake_env._files import write_json, write_text
from snake_env.errors import ConfigError
from snake_env.obstacles import to_plain

FORMAT = "snake_env scene 1"
"""Value of the field "format" in a file."""


def write(path: str | Path, fields: Mapping[str, Any]) -> None:
    """Write the fields of a scene; what follows from the suffix is the notation."""
    content = {"format": FORMAT} | plain(fields)
    if Path(path).suffix not in YAML:
        write_json(path, content)
        return
    with extras():
        import yaml
    write_text(path, yaml.safe_dump(content, sort_keys=False))


def read(path: str | Path) -> dict[str, Any]:
    """The fields of a scene as the file has them.

    Raises:
        ConfigError: the file is not a scene.
    """
    source = Path(path)
    try:
        fields = _documents.read(source)
    except OSError as error:
        raise ConfigError("path", repr(str(path)), f"a file that can be read ({error.strerror})") from None
    except ValueError as error:
        raise ConfigError("path", repr(str(path)), f"a file in {notation(source)} ({error})") from None
    if not isinstance(fields, dict) or fields.pop("format", None) != FORMAT:
        raise ConfigError("path", repr(str(path)), f'a file with "format": "{FORMAT}", as Scene.save writes it')
    return fields


def plain(fields: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a scene as JSON has them."""
    return {name: _plain(name, value) for name, value in fields.items()}


def _plain(name: str, value: Any) -> Any:
    if name == "obstacles":
        return [to_plain(obstacle) for obstacle in value]
    if name == "patches":
        return [plain(dataclasses.asdict(patch)) for patch in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    return value if value is None or isinstance(value, str | int | float) else np.asarray(value, np.float64).tolist()
