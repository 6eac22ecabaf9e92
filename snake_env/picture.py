"""What pictures of environments show: size, camera, zoom and layers. Nothing here imports pygame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from snake_env import _checks
from snake_env.config.section import freeze
from snake_env.errors import ConfigError
from snake_env.palette import FORCE_SCALE

LAYERS = ("grid", "goal", "obstacles", "trail", "links", "forces", "caption")
CAMERAS = ("follow", "fixed", "scene")


@dataclass(frozen=True)
class Picture:
    """How an environment is drawn; the keyword ``picture`` of every environment, also as a mapping.

    Args:
        size: width and height of the view from above [pixels], 64 to 4096; in 3D the strip with the view from the side
            comes below.
        camera: "follow" keeps the robot in the middle, "fixed" stays where the episode began or at ``centre``, "scene"
            shows the robot, the goal and all obstacles at once.
        centre: point in the middle of the picture of a fixed camera, (x, y) [m]; None: the robot at the start.
        zoom: 1 shows 2.8 m of the ground in a picture 800 pixels wide, 2 half of that; 0.05 to 20. "scene" has its own.
        layers: what is drawn, some of "grid", "goal", "obstacles", "trail", "links", "forces" and "caption".
        force_scale: length of the arrows of forces [m/N], 1e-6 to 1; the caption shows one with its force.

    Raises:
        ConfigError: names the field that is not admissible.
    """

    size: tuple[int, int] = (800, 480)
    camera: str = "follow"
    centre: tuple[float, float] | None = None
    zoom: float = 1.0
    layers: tuple[str, ...] = LAYERS
    force_scale: float = FORCE_SCALE

    def __post_init__(self) -> None:
        width, height = _pair("picture.size", self.size)
        for k, pixels in enumerate((width, height)):
            _checks.integer(f"picture.size[{k}]", pixels, 64, 4096)
        _checks.choice("picture.camera", self.camera, CAMERAS)
        if self.centre is not None:
            for k, value in enumerate(_pair("picture.centre", self.centre)):
                _checks.number(f"picture.centre[{k}]", value, -1e6, 1e6)
        _checks.number("picture.zoom", self.zoom, 0.05, 20.0)
        _checks.names("picture.layers", self.layers, LAYERS)
        _checks.number("picture.force_scale", self.force_scale, 1e-6, 1.0)
        freeze(self)

    @classmethod
    def of(cls, value: Any) -> Picture:
        """A picture from None, a mapping or a picture."""
        if value is None or isinstance(value, cls):
            return value or cls()
        if not isinstance(value, Mapping):
            raise ConfigError("picture", repr(value), "a snake_env.Picture, or a mapping of its fields")
        known = [one.name for one in fields(cls)]
        for name in value:
            if name not in known:
                raise ConfigError(f"picture.{name}", repr(value[name]), f"one of the fields {', '.join(known)}")
        return cls(**value)

    def shows(self, layer: str) -> bool:
        """Whether a layer is drawn."""
        return layer in self.layers


def _pair(field: str, value: Any) -> tuple[Any, Any]:
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise ConfigError(field, repr(value), "two numbers")
    return value[0], value[1]
