"""Tracks of the benchmark: what a policy may sense, as sets of blocks of the observation, from ``tracks.json``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from snake_env import _checks
from snake_env.errors import ConfigError

FILE = Path(__file__).with_suffix(".json")


@cache
def load() -> dict[str, dict[str, Any]]:
    """Each track, the narrowest first: what it ``senses``, the track it goes ``beyond``, and its own ``blocks``."""
    tracks: dict[str, dict[str, Any]] = json.loads(FILE.read_text())
    return tracks


def blocks(track: str) -> list[str]:
    """Every block that is admitted in a track.

    Raises:
        ConfigError: there is no such track.
    """
    known = load()
    one = known[_checks.choice("track", track, list(known))]
    return [*(blocks(one["beyond"]) if "beyond" in one else []), *one["blocks"]]


def observed(layout: dict[str, Any]) -> list[str]:
    """The blocks of an environment's observation."""
    return [block["name"] for block in layout["observation"]]


def narrowest(seen: Sequence[str]) -> str | None:
    """The first track that admits these blocks; None: no track does."""
    return next((track for track in load() if set(seen) <= set(blocks(track))), None)


def require(track: str, seen: Sequence[str]) -> None:
    """Refuses what a track does not admit.

    Raises:
        ConfigError: names the block and the track.
    """
    admitted = blocks(track)
    for name in seen:
        if name not in admitted:
            expected = f"blocks of the track {track}: {', '.join(admitted)}"
            raise ConfigError("observation_blocks", name, expected)
