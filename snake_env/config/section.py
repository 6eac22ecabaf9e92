"""A section of the configuration."""

from __future__ import annotations

import dataclasses
import math
import operator
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from types import SimpleNamespace
from typing import Any, ClassVar, TypeVar, cast

from typing_extensions import Self

from snake_env._native import check, defaults
from snake_env.errors import ConfigError

DEGREE = math.pi / 180.0

PYTHON_ONLY = {"python_only": True}
"""Metadata of a field that the core does not know."""

DEEPEST = 3
"""No field nests lists deeper. The core refuses those that do; one may contain itself."""

PLAIN = frozenset([float, int, bool, str, type(None)])
"""Types of most values, which nothing need be asked about."""


class Section:
    """A section of the configuration: a frozen dataclass that the core checks when it is made.

    The core reads its fields by name. A field whose default is None is left out while it is None. Lists and arrays
    become tuples, so that nobody changes a section after its check.
    """

    _section: ClassVar[str]
    _aliases: ClassVar[tuple[str, ...]] = ()
    _parts: ClassVar[Mapping[str, type[Section]]] = {}
    """Fields that are sections themselves, and their classes; one whose default is None may be None."""
    _listed: ClassVar[frozenset[str]] = frozenset()
    """Those of them that may also be lists of sections, and lists of such lists."""

    def __post_init__(self) -> None:
        for name, part in self._parts.items():
            value = getattr(self, name)
            listed = DEEPEST if name in self._listed else 0
            if not _is_made_of(part, value, listed) and value is not getattr(type(self), name):
                raise ConfigError(f"{self._section}.{name}", repr(value), f"a snake_env.{part.__name__}")
        freeze(self)
        check(self._section, self)

    @classmethod
    def of(cls, value: Any, path: str | None = None) -> Self:
        """The section that a user gives: itself, a mapping of its fields, or None for the default.

        Args:
            value: what the user gives.
            path: names it in errors; by default the name of the section.

        Raises:
            ConfigError: names the field, the value and what is admissible.
        """
        path = path or cls._section
        if value is None or isinstance(value, cls):
            return cls() if value is None else value
        if not isinstance(value, Mapping):
            expected = f"a snake_env.{cls.__name__}, or a mapping of field names to values"
            raise ConfigError(path, repr(value), expected)
        known = [field.name for field in dataclasses.fields(cls) if field.init]  # type: ignore[arg-type]
        for name, one in value.items():
            if name not in known and name not in cls._aliases:
                raise ConfigError(f"{path}.{name}", repr(one), "a known field: " + ", ".join(known))
        try:
            sections = {
                name: _made_of(part, value[name], f"{cls._section}.{name}")
                for name, part in cls._parts.items()
                if name in value
            }
            return cls(**{**value, **sections})
        except ConfigError as error:
            raise renamed(error, cls._section, path) from None


def _is_made_of(part: type[Section], value: Any, depth: int) -> bool:
    """Whether a value is a section, or lists of them, nested up to ``depth`` times."""
    if depth and isinstance(value, list | tuple):
        return bool(value) and all(_is_made_of(part, one, depth - 1) for one in value)
    return isinstance(value, part)


def _made_of(part: type[Section], value: Any, path: str, depth: int = DEEPEST) -> Any:
    """A value whose mappings, also those in lists, are sections."""
    if isinstance(value, Mapping):
        return part.of(value, path)
    if depth and isinstance(value, list | tuple):
        return [_made_of(part, one, f"{path}[{j}]", depth - 1) for j, one in enumerate(value)]
    return value


AnySection = TypeVar("AnySection", bound=type[Section])


def deprecated_alias(old: str, new: str) -> Callable[[AnySection], AnySection]:
    """Decorator of a section: ``old``, an earlier name of the field ``new``, still works, with a warning."""

    def warn() -> None:
        warnings.warn(f"{old} is called {new} now", DeprecationWarning, stacklevel=3)

    def decorate(section: AnySection) -> AnySection:
        changed = cast(Any, section)
        initialise = changed.__init__

        @wraps(initialise)
        def initialise_either(self: Section, *values: Any, **fields: Any) -> None:
            if old in fields:
                warn()
                initialise(self, *values, **{new: fields.pop(old)}, **fields)
            else:
                initialise(self, *values, **fields)

        def value(self: Section) -> Any:
            warn()
            return getattr(self, new)

        changed.__init__ = initialise_either
        setattr(changed, old, property(value))
        section._aliases = (*section._aliases, old)
        return section

    return decorate


def renamed(error: ConfigError, section: str, path: str) -> ConfigError:
    """The error of a section that a larger configuration has at ``path``."""
    return ConfigError(path + error.field.removeprefix(section), error.value, error.expected)


def freeze(section: Any) -> None:
    """Lists and arrays in the fields of a frozen dataclass become tuples."""
    for field in dataclasses.fields(section):
        value = getattr(section, field.name)
        if (plain := frozen(value)) is not value:
            object.__setattr__(section, field.name, plain)


def core_defaults(section: str, model: str = "planar") -> Any:
    """The core's defaults of a section, as attributes; lists are tuples."""
    values = defaults(section, model)
    return SimpleNamespace(**{name: frozen(value) for name, value in values.items()})


def frozen(value: Any, depth: int = 0) -> Any:
    """A value whose sequences and arrays, at any depth, are tuples, as the core reads them; itself if it is one."""
    kind = type(value)
    if kind in PLAIN:
        return value
    if kind not in (list, tuple):
        if hasattr(value, "__array__") and not isinstance(value, type):
            value = value.tolist()
        if not isinstance(value, Sequence) or isinstance(value, str | bytes | bytearray):
            return value
    if depth > DEEPEST:
        return value
    if PLAIN.issuperset(map(type, value)):
        return tuple(value)
    items = tuple([frozen(item, depth + 1) for item in value])
    return value if kind is tuple and all(map(operator.is_, items, value)) else items
