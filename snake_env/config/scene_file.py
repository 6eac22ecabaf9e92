"""Scenes as files: JSON, and YAML where PyYAML is installed."""

from __future__ import annotations

import dataclasses
import importlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from snake_env.errors import ConfigError
from snake_env.obstacles import to_plain

FORMAT = "snake_env scene 1"
"""Value of the field "format" in a file."""

YAML = (".yaml", ".yml")
"""Suffixes of YAML files."""


def write(path: str | Path, fields: Mapping[str, Any]) -> None:
    """Write the fields of a scene; what follows from the suffix is the notation."""
    plain = {"format": FORMAT} | {name: _plain(name, value) for name, value in fields.items()}
    target = Path(path)
    if target.suffix in YAML:
        text = _yaml(target).safe_dump(plain, sort_keys=False)
    else:
        text = json.dumps(plain, indent=2) + "\n"
    target.write_text(text, encoding="utf-8")


def read(path: str | Path) -> dict[str, Any]:
    """The fields of a scene as the file has them.

    Raises:
        ConfigError: the file is not a scene.
    """
    source = Path(path)
    fields = _parse(source)
    if not isinstance(fields, dict) or fields.pop("format", None) != FORMAT:
        raise ConfigError("path", repr(str(path)), f'a file with "format": "{FORMAT}", as Scene.save writes it')
    return fields


def _parse(source: Path) -> Any:
    try:
        text = source.read_text(encoding="utf-8")
        return _yaml(source).safe_load(text) if source.suffix in YAML else json.loads(text)
    except OSError as error:
        raise ConfigError("path", repr(str(source)), f"a file that can be read ({error.strerror})") from None
    except ConfigError:
        raise
    except ValueError as error:
        raise ConfigError("path", repr(str(source)), f"a file in JSON ({error})") from None
    except Exception as error:
        if type(error).__module__.startswith("yaml"):
            raise ConfigError("path", repr(str(source)), f"a file in YAML ({error})") from None
        raise


def _yaml(path: Path) -> Any:
    try:
        return importlib.import_module("yaml")
    except ImportError:
        raise ConfigError("path", repr(str(path)), "a .json file: YAML needs the package PyYAML") from None


def _plain(name: str, value: Any) -> Any:
    if name == "obstacles":
        return [to_plain(obstacle) for obstacle in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    return value if value is None or isinstance(value, str | int | float) else np.asarray(value, np.float64).tolist()
