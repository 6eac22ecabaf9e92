"""The exceptions of the package, which the native module defines."""

from __future__ import annotations

from snake_env._native import ConfigError, DivergenceError, InternalError

__all__ = ["ConfigError", "DivergenceError", "InternalError"]
