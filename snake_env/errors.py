"""The one error of bad input."""

from __future__ import annotations


class ConfigError(ValueError):
    """Bad input, rejected: names the field, the offending value and what is admissible.

    Attributes:
        field: path of the field as the user writes it, e.g. ``robot.mass``.
        value: the offending value, as text.
        expected: what is admissible, in words.
    """

    def __init__(self, field: str, value: object, expected: str) -> None:
        super().__init__(field, value, expected)
        self.field = field
        self.value = value
        self.expected = expected

    def __str__(self) -> str:
        return f"{self.field} = {self.value}: expected {self.expected}"


class DivergenceError(RuntimeError):
    """A scripted run left the finite numbers.

    Attributes:
        time: simulated time of the last good state [s].
    """

    def __init__(self, time: float) -> None:
        super().__init__(time)
        self.time = time

    def __str__(self) -> str:
        return f"the simulation diverged at t = {self.time:g} s: take a smaller step, or the implicit method"
