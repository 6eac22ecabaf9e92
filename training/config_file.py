"""Configuration files in YAML or JSON, as the values in them; nothing about what they mean."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, ClassVar

import yaml

from snake_env import ConfigError

CONFIGS = Path(__file__).parent / "configs"


def read(path: Path | str) -> dict[str, Any]:
    """The values of a configuration file, not yet checked.

    Raises:
        ConfigError: there is no such file or name, or it is not a mapping of what JSON has, each name once.
    """
    bare = [CONFIGS / f"{path}{suffix}" for suffix in (".yaml", ".json")]
    found = next((one for one in bare if one.exists()), Path(path))
    if not found.is_file():
        raise ConfigError("config", path, "a YAML or JSON file, or a name in training/configs")
    kind = "JSON" if found.suffix == ".json" else "YAML"
    try:
        text = found.read_text()
        values = json.loads(text, object_pairs_hook=_each_once) if kind == "JSON" else _yaml(text)
    except (TypeError, ValueError, yaml.YAMLError) as error:
        raise ConfigError("config", found, f"{kind} ({' '.join(str(error).split())})") from None
    if not isinstance(values, dict):
        raise ConfigError("config", found, "a mapping of names to values")
    return values


def _yaml(text: str) -> Any:
    """The values of a YAML text, of the kinds that JSON has: what YAML takes for a date remains a string."""

    class Loader(yaml.SafeLoader):
        """Refuses a name that a mapping has twice."""

        yaml_implicit_resolvers: ClassVar = {
            first: [one for one in resolvers if one[0] != "tag:yaml.org,2002:timestamp"]
            for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
        }

        def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
            _each_once([(key.value, None) for key, _ in node.value])
            return super().construct_mapping(node, deep)

    values = yaml.load(text, Loader)
    json.dumps(values)  # raises where a tag makes something else
    return values or {}


def _each_once(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    """The pairs of a mapping as a dict.

    Raises:
        ValueError: two pairs have one name.
    """
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name} is there {names.count(name)} times")
    return dict(pairs)
