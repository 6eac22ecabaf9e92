"""JSON and YAML from outside: of bounded size and depth, each name once."""

from __future__ import annotations

import json
import lzma
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

from snake_env._extras import MissingExtra, extras
from snake_env.errors import ConfigError

LARGEST = 2**26
"""Size of a file [bytes]."""

DEEPEST = 32
"""Mappings and lists within each other."""

YAML = (".yaml", ".yml")
"""Suffixes of YAML files."""

BROKEN = (
    *(AttributeError, EOFError, ImportError, IndexError, KeyError, MemoryError, OSError, OverflowError, RuntimeError),
    *(SyntaxError, TypeError, ValueError, lzma.LZMAError, pickle.UnpicklingError, struct.error),
    *(zipfile.BadZipFile, zlib.error),
)
"""What readers of files raise about broken ones."""


@contextmanager
def reading(field: str, path: str | Path, expected: str) -> Iterator[None]:
    """For readers of files that are not text.

    Raises:
        ConfigError: the file is broken; the reason follows ``expected``.
    """
    try:
        yield
    except (ConfigError, MissingExtra):
        raise
    except BROKEN as error:
        reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise ConfigError(field, str(path), f"{expected} ({reason})") from None


def notation(path: Path) -> str:
    """YAML or JSON, by the suffix of a file."""
    return "YAML" if path.suffix in YAML else "JSON"


def require_size(path: Path) -> None:
    """Looks at a file before it is read.

    Raises:
        OSError: there is no such file.
        ValueError: it is too large, or something else than a file.
    """
    size = path.stat().st_size
    if not path.is_file():
        raise ValueError("it is not a regular file")
    if size > LARGEST:
        raise ValueError(f"it has {size:,} bytes, {LARGEST:,} are the most")


def read(path: Path) -> Any:
    """The content of a file, YAML or else JSON by its suffix.

    Raises:
        OSError: it cannot be read.
        ValueError: it is too large, too deep, has a name twice, or is of another format.
    """
    require_size(path)
    text = path.read_text(encoding="utf-8")
    return of_yaml(text) if path.suffix in YAML else of_json(text)


def of_json(text: str) -> Any:
    """The content of a JSON text.

    Raises:
        ValueError: it is none, too deep, or has a name twice.
    """
    return _flat(lambda: json.loads(text, object_pairs_hook=_each_once))


def of_yaml(text: str) -> Any:
    """The content of a YAML text, of the kinds that JSON has: what YAML takes for a date remains a string.

    Raises:
        ValueError: it is none, too deep, has a name twice, an alias, or what JSON does not have.
    """
    with extras():
        import yaml

    class Loader(yaml.SafeLoader):
        """Refuses aliases, which make a large content of a small file, and a name that a mapping has twice."""

        yaml_implicit_resolvers: ClassVar = {
            first: [one for one in resolvers if one[0] != "tag:yaml.org,2002:timestamp"]
            for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
        }

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                raise ValueError(f"an alias, *{self.peek_event().anchor}, which is not supported")
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
            _each_once([(str(key.value), None) for key, _ in node.value])
            mapping: dict[Any, Any] = super().construct_mapping(node, deep)
            return mapping

    def load() -> Any:
        try:
            return yaml.load(text, Loader)
        except yaml.YAMLError as error:
            raise ValueError(" ".join(str(error).split())) from None

    content = _flat(load)
    try:
        json.dumps(content)
    except TypeError as error:
        raise ValueError(str(error)) from None
    return content


def _flat(load: Callable[[], Any]) -> Any:
    """What ``load`` returns, unless it is nested too deeply."""
    try:
        content = load()
    except RecursionError:
        raise ValueError(f"nested deeper than {DEEPEST} levels") from None
    level = [content]
    for _ in range(DEEPEST + 1):
        inside = (one.values() if isinstance(one, dict) else one for one in level if isinstance(one, dict | list))
        level = [child for children in inside for child in children if isinstance(child, dict | list)]
        if not level:
            return content
    raise ValueError(f"nested deeper than {DEEPEST} levels")


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs of a mapping as a dict."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"{name} is there twice")
        found[name] = value
    return found
