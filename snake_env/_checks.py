"""Checks of arguments at the edge of the package; each error names the argument."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env.errors import ConfigError

SEED_RANGE = "an integer in [0, 2^64)"


def plain(value: Any) -> Any:
    """Mappings, lists and tuples with Python's own numbers and lists in place of NumPy's."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    return type(value)(map(plain, value)) if type(value) in (list, tuple) else value


def integer(field: str, value: Any, low: int, high: int | None = None) -> int:
    """An integer not below ``low``, nor above ``high``."""
    expected = f"an integer >= {low}" if high is None else f"an integer in [{low}, {high}]"
    if isinstance(value, bool | np.bool_):
        raise ConfigError(field, value, expected)
    try:
        number = operator.index(value)
    except TypeError:
        raise ConfigError(field, repr(value), expected) from None
    if number < low or (high is not None and number > high):
        raise ConfigError(field, value, expected)
    return number


def number(field: str, value: Any, low: float = -math.inf, high: float = math.inf, alternative: str = "") -> float:
    """A finite number in [low, high]; ``alternative`` says in the error what else is admissible."""
    expected = "a finite number" if (low, high) == (-math.inf, math.inf) else f"a number in [{low:g}, {high:g}]"
    found = _real(value)
    if found is None or not low <= found <= high:
        raise ConfigError(field, repr(value), alternative + expected)
    return found


def positive(field: str, value: Any) -> float:
    """A finite number > 0."""
    found = _real(value)
    if found is None or found <= 0.0:
        raise ConfigError(field, repr(value), "a finite number > 0")
    return found


def _real(value: Any) -> float | None:
    """A finite number of Python or NumPy; None for all else, True and False among it."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        found = float(value)
    except OverflowError:
        return None
    return found if math.isfinite(found) else None


def reals(field: str, value: Any, expected: str = "real numbers") -> NDArray[np.float64]:
    """A new C-contiguous array of finite real numbers.

    Text, bools and complex numbers are none, although NumPy would convert them; in a list one of them among numbers
    would not show in the type of the array.
    """
    try:
        array = np.array(value)
        is_mixed = not isinstance(value, np.ndarray) and _has_bools(value)
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise ConfigError(field, repr(value), expected) from None
    if array.dtype.kind not in "fiu" or is_mixed:
        found = f"an array of dtype {array.dtype}" if isinstance(value, np.ndarray) else repr(value)
        raise ConfigError(field, found, expected)
    finite(field, array)
    return np.ascontiguousarray(array, np.float64).reshape(array.shape)


def times(value: Any) -> list[float]:
    """A finite time or an array (T,) of them."""
    array = np.atleast_1d(reals("time", value, "a time or times (T,)"))
    if array.ndim != 1:
        raise ConfigError("time", f"an array of shape {array.shape}", "a time or times (T,)")
    return array.tolist()


def _has_bools(value: Any) -> bool:
    """Whether a number, or one in nested lists, is a bool."""
    if isinstance(value, list | tuple):
        return any(map(_has_bools, value))
    if isinstance(value, np.ndarray):
        return value.dtype == np.bool_
    return isinstance(value, bool | np.bool_)


def seed(value: Any, field: str = "seed") -> int:
    """A seed of one robot."""
    try:
        number = integer(field, value, 0)
    except ConfigError:
        raise ConfigError(field, repr(value), SEED_RANGE) from None
    if number >= 2**64:
        raise ConfigError(field, value, SEED_RANGE)
    return number


def seeds(value: int | Sequence[int | None] | None, num_envs: int) -> list[int | None]:
    """One seed per robot: robot ``i`` takes ``value + i``, or entry ``i`` of a sequence."""
    if value is None:
        return [None] * num_envs
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str | bytes | bytearray):
        first = seed(value)
        return [seed(first + i) for i in range(num_envs)]
    if len(value) != num_envs:
        raise ConfigError("seed", f"{len(value)} seeds", f"None, an integer or {num_envs} seeds, one per environment")
    return [None if one is None else seed(one, f"seed[{i}]") for i, one in enumerate(value)]


def mask(field: str, value: Any, num_envs: int) -> NDArray[np.bool_]:
    """A boolean array of one entry per environment, at least one of them True."""
    expected = f"a bool array of shape ({num_envs},) with at least one True"
    if not isinstance(value, np.ndarray) or value.dtype != np.bool_:
        kind = f"dtype {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__
        raise MaskTypeError(field, kind, expected)
    if value.shape != (num_envs,) or not value.any():
        raise ConfigError(field, f"shape {value.shape} with {np.count_nonzero(value)} True", expected)
    return np.ascontiguousarray(value)


class MaskTypeError(ConfigError, TypeError):
    """A mask that is not a boolean array: a TypeError, as Gymnasium's own vector environments raise."""


def options(value: Mapping[str, Any] | None, known: Sequence[str]) -> Mapping[str, Any]:
    """Options of a reset; every key must be known."""
    if value is not None and not isinstance(value, Mapping):
        raise ConfigError("options", repr(value), "None or a mapping")
    for key in value or ():
        if key not in known:
            raise ConfigError(f"options[{key!r}]", repr((value or {})[key]), _one_of(known))
    return value or {}


def _one_of(known: Sequence[str]) -> str:
    return "one of the options " + ", ".join(known) if known else "no options"


def actions(value: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Actions as a C-contiguous float32 array of the given shape; finiteness is checked in the core."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise ConfigError("action", "rows of different lengths", f"shape {shape}") from None
    if array.dtype.kind not in "fiu":
        raise ConfigError("action", f"dtype {array.dtype}", "real numbers, float32")
    if array.shape != shape:
        raise ConfigError("action", f"shape {array.shape}", f"shape {shape}")
    return np.ascontiguousarray(array, np.float32)


def finite(field: str, array: NDArray[Any]) -> None:
    """Numbers only; the error names the first element that is none."""
    if not np.isfinite(array).all():
        index = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        raise ConfigError(f"{field}{list(index)}" if index else field, array[index], "a finite number")


def function(field: str, value: Any, call: str) -> Any:
    """None or something that can be called."""
    if value is not None and not callable(value):
        raise ConfigError(field, repr(value), f"None or a function {call}")
    return value


def names(field: str, value: Any, admissible: Sequence[str]) -> tuple[str, ...]:
    """A sequence of some of the admissible names."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise ConfigError(field, repr(value), "a list of names")
    return tuple(choice(f"{field}[{k}]", name, admissible) for k, name in enumerate(value))


def step_limit(value: Any, default: int | None) -> int | None:
    """Steps of an episode; ``default`` for None, and None, no limit, for -1."""
    if value is None:
        return default
    try:
        number = integer("max_episode_steps", value, -1)
    except ConfigError:
        number = 0
    if number == 0:
        raise ConfigError("max_episode_steps", repr(value), "an integer >= 1, None, or -1 for no limit")
    return None if number == -1 else number


def same(value: Any, expected: Any) -> bool:
    """Whether two values are equal; arrays and the like, whose equality is not one truth value, are not."""
    try:
        return bool(value == expected)
    except (TypeError, ValueError):
        return False


def kind(field: str, value: Any, types: Any, expected: str) -> Any:
    """A value of one of a few types."""
    if not isinstance(value, types):
        raise ConfigError(field, repr(value), expected)
    return value


def choice(field: str, value: Any, admissible: Sequence[Any]) -> Any:
    """One of a few values."""
    if not any(same(value, one) for one in admissible):
        raise ConfigError(field, repr(value), "one of " + ", ".join(repr(one) for one in admissible))
    return value
