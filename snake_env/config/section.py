"""A part of the configuration."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

from snake_env import _native
from snake_env._encode import encode

DEGREE = math.pi / 180.0


class Section:
    """A part of the configuration: one JSON object of the core, checked when it is made."""

    _section: ClassVar[str]

    def __post_init__(self) -> None:
        _native.check(self._section, encode(self._for_core(), self._section))

    def _for_core(self) -> dict[str, Any]:
        """The fields that the core knows."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}  # type: ignore[arg-type]
