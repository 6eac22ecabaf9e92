"""Controls of a page, whose values are those that they offer, whatever a page sends."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

FAR = 1e3
"""Places are nearer [m]."""

Admits = Callable[[Any], bool]


class Control:
    """A control of viser; a value that it does not offer changes nothing.

    Args:
        handle: of viser.
        admits: whether a value is one that it offers.
    """

    def __init__(self, handle: Any, admits: Admits) -> None:
        self._handle, self._admits, self._last = handle, admits, handle.value

    @property
    def value(self) -> Any:
        """The last value that it offers."""
        found = self._handle.value
        if type(found) is type(self._last) and self._admits(found):
            self._last = found
        else:
            self._handle.value = self._last
        return self._last

    @value.setter
    def value(self, value: Any) -> None:
        if self._admits(value):
            self._handle.value = value

    def on_update(self, call: Callable[[], Any]) -> None:
        """Calls a function when the value is another one than at its last call."""
        seen = self.value

        def changed(_: Any) -> None:
            nonlocal seen
            if (now := self.value) != seen:
                seen = now
                call()

        self._handle.on_update(changed)


def checkbox(gui: Any, name: str, initial: bool) -> Control:
    """True or False."""
    return Control(gui.add_checkbox(name, initial_value=initial), lambda value: isinstance(value, bool))


class Slider(Control):
    """A number between two others.

    Attributes:
        min: its least value.
        max: its largest one.
    """

    def __init__(self, gui: Any, name: str, low: float, high: float, step: float, initial: float) -> None:
        self.min, self.max = low, high
        super().__init__(gui.add_slider(name, low, high, step, initial_value=initial), between(low, high))


def count(gui: Any, name: str, most: int | None = None, hint: str | None = None) -> Control:
    """An integer from zero on."""
    high = 10**6 if most is None else most
    return Control(gui.add_number(name, 0, min=0, max=most, step=1, hint=hint), between(0, high))


def choice(gui: Any, name: str, offered: Sequence[str], initial: str) -> Control:
    """One of a few texts."""
    return Control(gui.add_dropdown(name, tuple(offered), initial_value=initial), frozenset(offered).__contains__)


def between(low: float, high: float) -> Admits:
    """Whether a value is a number between two others."""
    return lambda value: isinstance(value, int | float) and math.isfinite(value) and low <= value <= high


def place(position: Any) -> NDArray[np.float64] | None:
    """A place (3,) that a page sends [m]; None if it is none, or far away."""
    try:
        found = np.asarray(position, np.float64)
    except (TypeError, ValueError):
        return None
    return found if found.shape == (3,) and (np.abs(found) < FAR).all() else None
