"""Test scenes, episodes, scores and their statistics.

One direction of imports: ``seeds, tasks, statistics <- rollout <- scores, film <- protocol``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from snake_env.evaluation.tasks import BenchmarkTask

if TYPE_CHECKING:
    from snake_env.evaluation.protocol import Evaluation, evaluate

__all__ = ["BenchmarkTask", "Evaluation", "evaluate"]


def __getattr__(name: str) -> Any:
    """Scores need SciPy, which scenes and episodes do without."""
    if name in ("Evaluation", "evaluate"):
        return getattr(import_module("snake_env.evaluation.protocol"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
