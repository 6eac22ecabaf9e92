"""Configuration as JSON text, the form in which it travels to the Rust core."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from snake_env.errors import ConfigError


def encode(value: Any, field: str = "") -> str:
    """JSON text of a configuration made of dataclasses, mappings, sequences, numbers and strings.

    JSON has no word for infinities and NaN: they become strings, which the core rejects by field name.

    Raises:
        ConfigError: names the field whose value is of a type that no field has.
    """
    return json.dumps(_plain(value, field))


def _plain(value: Any, field: str) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item, f"{field}.{key}".lstrip(".")) for key, item in value.items()}
    if isinstance(value, Sequence):
        return [_plain(item, f"{field}[{k}]") for k, item in enumerate(value)]
    raise ConfigError(field, repr(value), "a number, a string, a sequence or a mapping of these")
