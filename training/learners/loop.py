"""The loop of a training run: collect, learn, save checkpoints, until the budget is used up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from snake_env.policies import files
from training.budget import Budget, StopRequest
from training.config import RunConfig
from training.learning_curve import LearningCurve, Note, text
from training.runs import RunFolder

SHOW_SECONDS = 5.0
"""Between two lines of progress."""


class Learner(Protocol):
    """What learns in a run.

    Attributes:
        config: Of the run.
        steps: Environment steps taken so far.
        checkpoint: Suffix of its checkpoints.
    """

    config: Any
    steps: int
    checkpoint: str

    def begin(self) -> None:
        """Prepares a run that has no checkpoint yet."""

    def collect(self) -> None:
        """Takes environment steps."""

    def learn(self, used: float) -> None:
        """Learns from them; ``used`` is the share of the budget that is used up."""

    def save(self, path: Path) -> None:
        """Writes a checkpoint."""

    def restore(self, path: Path) -> None:
        """Reads a checkpoint."""

    def arrays(self) -> files.Arrays:
        """Arrays of the policy file."""
        ...

    def close(self) -> None:
        """Closes the environments."""


def run(folder: RunFolder, config: RunConfig, make: Callable[[int, Note, float], Learner], show: bool) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped.

    Args:
        folder: Of the run.
        config: Of the run.
        make: Makes the learner from the steps taken before, a receiver of finished episodes, and the share of the
            budget used up before.
        show: Print progress.
    """
    checkpoint = folder.latest()
    steps = 0 if checkpoint is None else int(checkpoint.stem)
    budget = Budget(config.total_steps, config.max_minutes, 0.0 if checkpoint is None else folder.seconds(checkpoint))
    budget.note(steps)
    curve = LearningCurve(budget, steps)
    learner = make(steps, curve.note, budget.used)
    if checkpoint is None:
        learner.begin()
    else:
        with folder.resumed():
            learner.restore(checkpoint)
    with StopRequest() as stop:
        work(learner, folder, budget, curve, stop, show)
    folder.save_checkpoint(learner.save, learner.steps, budget.seconds, learner.checkpoint)
    policy = folder.path / files.NAME
    files.write(policy, learner.arrays(), config.model_dump(mode="json") | {"steps": learner.steps})
    learner.close()
    if stop.received:
        print(f"saved after {learner.steps} steps")
        return 130
    folder.finish({"steps": learner.steps, "seconds": round(budget.seconds, 1)})
    if show:
        print(f"{learner.steps} steps in {budget.seconds:.0f} s: {policy}")
    return 0


def work(
    learner: Learner, folder: RunFolder, budget: Budget, curve: LearningCurve, stop: StopRequest, show: bool
) -> None:
    """Collects and learns in turn until the budget is used up."""
    saved = shown = budget.seconds
    while budget.used < 1.0 and not stop.received:
        learner.collect()
        budget.note(learner.steps)
        row = curve.row(learner.steps)
        folder.append_curve(row)
        learner.learn(budget.used)
        if budget.seconds - saved >= learner.config.checkpoint_seconds:
            folder.save_checkpoint(learner.save, learner.steps, budget.seconds, learner.checkpoint)
            saved = budget.seconds
        if show and budget.seconds - shown >= SHOW_SECONDS:
            print(f"{100.0 * budget.used:3.0f} %  {text(row)}", flush=True)
            shown = budget.seconds
