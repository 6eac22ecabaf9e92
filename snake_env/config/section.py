"""A section of the configuration."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, ClassVar

from snake_env._native import check, defaults

DEGREE = math.pi / 180.0

PYTHON_ONLY = {"python_only": True}
"""Metadata of a field that the core does not know."""


class Section:
    """A section of the configuration: a frozen dataclass that the core checks when it is made.

    The core reads its fields by name. A field whose default is None is left out while it is None.
    """

    _section: ClassVar[str]

    def __post_init__(self) -> None:
        check(self._section, self)


def core_defaults(section: str, model: str = "planar") -> Any:
    """The core's defaults of a section, as attributes; lists are tuples."""
    values = defaults(section, model)
    return SimpleNamespace(**{name: frozen(value) for name, value in values.items()})


def frozen(value: Any) -> Any:
    """A value whose lists, at any depth, are tuples."""
    return tuple(frozen(item) for item in value) if isinstance(value, list) else value
