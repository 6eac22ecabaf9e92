"""Ranges of actions: those of a policy's training, and those of the environment that it plays in.

The motors of a robot bound its actions, so that the same action may stand for different frequencies of the wave in two
environments. Only actions, and observations of them, have ranges; everything else is the same in all environments.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

PLANAR_NAMES = (
    (r"(joint_angle|joint_rate|reference): yaw_", r"\1: joint_"),
    (r"\byaw_(offset|velocity|torque)_", r"joint_\1_"),
    (r"^((?:previous_action: )?)yaw_(\d)", r"\1joint_angle_\2"),
    (r"(contact_force: link_\d+)_left", r"\1"),
)
"""How elements of observations and actions of the 3D model are called in the planar one, where it has them."""


def planar_name(name: str) -> str:
    """Of the same element in the planar model."""
    for pattern, planar in PLANAR_NAMES:
        name = re.sub(pattern, planar, name)
    return name


class Conversion(NamedTuple):
    """From numbers with the ranges of one environment to those with the ranges of another, x -> scale x + shift."""

    scale: Floats
    shift: Floats

    @classmethod
    def of(cls, names: list[str], here: dict[str, Any], there: dict[str, Any]) -> Conversion:
        """For elements of observations or actions by name, from the layout ``here`` to the layout ``there``."""
        ranges = {entry["name"]: (entry["low"], entry["high"]) for entry in there["action"]}
        found = dict.fromkeys(names, (1.0, 0.0))
        for entry in here["action"]:
            if (known := ranges.get(entry["name"], ranges.get(planar_name(entry["name"])))) is not None:
                low, high = known
                scale = (entry["high"] - entry["low"]) / (high - low)
                shift = (entry["low"] + entry["high"] - low - high) / (high - low)
                of_action = {f"{block}{entry['name']}": (scale, shift) for block in ("", "wave: ", "previous_action: ")}
                found |= {name: of_action[name] for name in found.keys() & of_action.keys()}
        scales, shifts = zip(*(found[name] for name in names), strict=True)
        return cls(np.array(scales, np.float32), np.array(shifts, np.float32))

    def __call__(self, values: Floats) -> Floats:
        """The numbers there."""
        return values * self.scale + self.shift

    def back(self, values: Floats) -> Floats:
        """The numbers here."""
        return (values - self.shift) / self.scale


def have_equal_ranges(here: dict[str, Any], there: dict[str, Any]) -> bool:
    """Whether the actions of two layouts have the same ranges."""
    first, second = ([(entry["name"], entry["low"], entry["high"]) for entry in one["action"]] for one in (here, there))
    return first == second
