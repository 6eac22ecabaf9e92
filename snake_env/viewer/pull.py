"""A hand on the robot: a handle at one link, which a spring pulls towards the handle while it is dragged."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.state import State
from snake_env.viewer.controls import place

Array = NDArray[np.float64]

STIFFNESS, DAMPING, LARGEST = 60.0, 6.0, 30.0
"""Of the spring [N/m], [N s/m], and its largest force [N]; as in the playground."""
HEIGHT = 0.1
"""Of the handle over a robot in the plane [m]."""


class Pull:
    """A handle at a link of a scene of viser.

    Args:
        scene: of a server.
        link: index of the link.
        state: present state of the robot.
    """

    def __init__(self, scene: Any, link: int, state: State) -> None:
        self._link = link
        self._is_dragged = False
        planar = state.link_position.shape[1] == 2
        self._handle = scene.add_transform_controls(
            "/pull",
            scale=0.3,
            position=_place(state, link),
            active_axes=(True, True, not planar),
            disable_rotations=True,
        )
        self._handle.on_update(lambda event: self._drag(event.phase != "end"))

    def remove(self) -> None:
        """Takes the handle away."""
        self._handle.remove()

    def impulse(self, state: State, period: float) -> Array | None:
        """Impulses of the spring on the links (L, 2 or 3) in one control period [N s]; None unless it is dragged."""
        if not self._is_dragged:
            self._handle.position = _place(state, self._link)
            return None
        target = place(self._handle.position)
        if target is None:
            return None
        found = np.zeros_like(state.link_velocity)
        stretch = target[: found.shape[1]] - state.link_position[self._link]
        found[self._link] = period * force(stretch, state.link_velocity[self._link])
        return found

    def _drag(self, is_dragged: bool) -> None:
        self._is_dragged = is_dragged


def force(stretch: Array, velocity: Array) -> Array:
    """Of the spring [N], from its stretch [m] and the velocity of the link [m/s]."""
    found = STIFFNESS * stretch - DAMPING * velocity
    size = float(np.linalg.norm(found))
    return found * min(1.0, LARGEST / size) if size > 0.0 else found


def _place(state: State, link: int) -> tuple[float, ...]:
    """Of the handle [m]."""
    place = [float(value) for value in state.link_position[link]]
    return (*place, HEIGHT) if len(place) == 2 else tuple(place)
