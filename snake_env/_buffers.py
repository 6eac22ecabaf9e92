"""The arrays that a step returns, reused when nothing refers to them any more.

Reuse needs exact reference counts: CPython with the global interpreter lock. Elsewhere each step has new arrays, which
cost more than all other work of the interface.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]

OWN_REWARD = "reward_custom"
"""Entry of ``info`` with the reward of a reward function, in place of those of the built-in terms."""

POOL_SIZE = 3
"""Enough for a caller who holds the results of the last two steps."""


def counts_references() -> bool:
    """Whether ``sys.getrefcount`` tells all references to an object."""
    has_lock: Callable[[], bool] = getattr(sys, "_is_gil_enabled", lambda: True)
    return sys.implementation.name == "cpython" and has_lock()


class Arrays(NamedTuple):
    """What the core writes for n robots."""

    observation: NDArray[np.float32]
    """(n, o)"""
    reward: NDArray[np.float64]
    """(n,)"""
    terminated: Mask
    """(n,)"""
    truncated: Mask
    """(n,)"""
    signals: NDArray[np.float64]
    """(k, n), one row per signal"""
    flags: Mask
    """the bool rows of the signals"""
    counts: NDArray[np.int64]
    """the int rows of the signals"""


class StepBuffers:
    """Arrays for the results of one step, and the infos made of views of them.

    Args:
        num_envs: n.
        observation_size: o.
        signals: as the layout lists them.
        has_own_reward: a reward function replaces the built-in terms.

    Attributes:
        arrays: what the core writes.
        own_reward: what the reward function returned (n,).
        values: the signals by name, each (n,), of type float64, bool or int64.
    """

    def __init__(
        self, num_envs: int, observation_size: int, signals: list[dict[str, str]], has_own_reward: bool = False
    ) -> None:
        self.arrays = _zeros(num_envs, observation_size, [signal["kind"] for signal in signals])
        self.values = _values(self.arrays, signals)
        self.own_reward = np.zeros(num_envs)
        if has_own_reward:
            others = {name: values for name, values in self.values.items() if not name.startswith("reward_")}
            self.values = {OWN_REWARD: self.own_reward, **others}
        self._all_rows = np.ones((len(self.values), num_envs), np.bool_)
        self._infos = self.values | _masks(self.values, self._all_rows)
        self._watched = [*self.arrays, self._all_rows, *self._infos.values()]
        self._idle = self._references() if counts_references() else None

    def _references(self) -> list[int]:
        """How many references each array has."""
        return list(map(sys.getrefcount, self._watched))

    def is_idle(self) -> bool:
        """Whether nothing outside refers to any of the arrays; a view of an array refers to it too."""
        return self._idle is not None and self._references() == self._idle

    def infos(self) -> dict[str, NDArray[Any]]:
        """Gymnasium's ``infos`` where all robots report."""
        self._all_rows.fill(True)
        return self._infos.copy()

    def masked_infos(self, mask: Mask) -> dict[str, NDArray[Any]]:
        """Gymnasium's ``infos`` where the robots in ``mask`` report: copies, zero outside the mask."""
        infos = {name: np.where(mask, values, values.dtype.type(0)) for name, values in self.values.items()}
        return infos | _masks(self.values, np.tile(mask, (len(self.values), 1)))

    def numbers(self) -> dict[str, float | bool | int]:
        """The info of robot 0."""
        return {name: values.item(0) for name, values in self.values.items()}


def _zeros(num_envs: int, observation_size: int, kinds: list[str]) -> Arrays:
    return Arrays(
        np.zeros((num_envs, observation_size), np.float32),
        np.zeros(num_envs),
        np.zeros(num_envs, np.bool_),
        np.zeros(num_envs, np.bool_),
        np.zeros((len(kinds), num_envs)),
        np.zeros((kinds.count("bool"), num_envs), np.bool_),
        np.zeros((kinds.count("int"), num_envs), np.int64),
    )


def _masks(names: Iterable[str], rows: Mask) -> dict[str, Mask]:
    """Gymnasium's masks of ``infos``, an array for each, so that a caller may write to one of them."""
    return {f"_{name}": row for name, row in zip(names, rows, strict=True)}


def _values(arrays: Arrays, signals: list[dict[str, str]]) -> dict[str, NDArray[Any]]:
    """Views of the rows that hold each signal with its own type."""
    typed = {"bool": iter(arrays.flags), "int": iter(arrays.counts)}
    return {
        signal["name"]: next(typed[signal["kind"]]) if signal["kind"] in typed else row
        for signal, row in zip(signals, arrays.signals, strict=True)
    }


class BufferPool:
    """A few step buffers in turn.

    What a caller holds is never written again: buffers are reused when they are idle, and replaced otherwise.
    """

    def __init__(
        self, num_envs: int, observation_size: int, signals: list[dict[str, str]], has_own_reward: bool = False
    ) -> None:
        self._shape = (num_envs, observation_size, signals, has_own_reward)
        self._pool: list[StepBuffers] = []

    def new(self) -> StepBuffers:
        """Fresh arrays, all zero."""
        return StepBuffers(*self._shape)

    def take(self) -> StepBuffers:
        """Buffers that nothing refers to."""
        for buffers in self._pool:
            if buffers.is_idle():
                return buffers
        buffers = self.new()
        self._pool = [buffers, *self._pool[: POOL_SIZE - 1]]
        return buffers

    def __getstate__(self) -> dict[str, Any]:
        """Results are not part of what is pickled or copied."""
        return {"_shape": self._shape, "_pool": []}
