"""The exceptions of the package, which the native module defines, and how one reads."""

from __future__ import annotations

from snake_env._native import ConfigError, DivergenceError, InternalError

__all__ = ["ConfigError", "DivergenceError", "InternalError"]

LONGEST = {"field": 120, "value": 200, "expected": 720}
"""Parts of a message [bytes]: values may come from files, and be of any length."""


def shortened(text: str, longest: int) -> str:
    """A text of at most so many bytes in UTF-8, without its middle if it is longer."""
    whole = text.encode(errors="backslashreplace")
    if len(whole) <= longest:
        return text
    half = longest // 2 - 3
    return f"{whole[:half].decode(errors='ignore')} ... {whole[-half:].decode(errors='ignore')}"


def _message(error: BaseException) -> str:
    field, value, expected = (shortened(str(getattr(error, part)), most) for part, most in LONGEST.items())
    return f"{field} = {value}: expected {expected}"


ConfigError.__str__ = _message  # type: ignore[method-assign]
