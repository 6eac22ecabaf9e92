"""The loop of the learners of this package: collect, learn, evaluate, keep checkpoints, until the budget is used."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from snake_env.policies import Network, files
from training import tracking
from training.budget import Budget, Interval, StopRequest
from training.config import RunConfig
from training.learning_curve import LearningCurve, Note, text
from training.pace import Pace
from training.progress import Progress
from training.runs import RunFolder


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

    @property
    def simulator_seconds(self) -> float:
        """Wall time spent in the simulator so far [s]."""
        ...

    def begin(self) -> None:
        """Prepares a run that has no checkpoint yet."""

    def collect(self) -> None:
        """Takes environment steps."""

    def learn(self, used: float) -> dict[str, float]:
        """Learns from them; ``used`` is the share of the budget that is used up. Returns diagnostics by name."""
        ...

    def save(self, path: Path, curve: dict[str, Any]) -> None:
        """Writes a checkpoint; ``curve`` is the state of the learning curve."""

    def restore(self, path: Path) -> dict[str, Any]:
        """Reads a checkpoint; returns the state of the learning curve."""
        ...

    def arrays(self) -> files.Arrays:
        """Arrays of the policy file."""
        ...

    def close(self) -> None:
        """Closes the environments."""


def run(
    folder: RunFolder,
    config: RunConfig,
    make: Callable[[int, Note, float], Learner],
    show: bool,
) -> int:
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
    budget = Budget(config.total_steps, steps, 0.0 if checkpoint is None else folder.seconds(checkpoint))
    curve = LearningCurve(budget, steps)
    learner = make(steps, curve.note, budget.used)
    if checkpoint is None:
        learner.begin()
    else:
        with folder.resumed():
            curve.restore(learner.restore(checkpoint))
    work = Work(learner, folder, config, budget, curve, show)
    with StopRequest() as stop:
        work.until(stop)
        stopped = stop.received
    work.save()
    work.write_policy(folder.path / files.NAME)
    work.tracker.close()
    learner.close()
    if stopped:
        print(f"saved after {learner.steps} steps")
        return 130
    folder.finish({"steps": learner.steps, "seconds": round(budget.seconds, 1)})
    if show:
        print(f"{learner.steps} steps in {budget.seconds:.0f} s: {folder.path / files.NAME}")
    return 0


class Work:
    """Collects and learns in turn.

    Args:
        learner: Learns.
        folder: Of the run.
        config: Of the run.
        budget: Of the run.
        curve: Of the run.
        show: Print progress.
    """

    def __init__(
        self,
        learner: Learner,
        folder: RunFolder,
        config: RunConfig,
        budget: Budget,
        curve: LearningCurve,
        show: bool,
    ) -> None:
        self._learner, self._folder, self._config = learner, folder, config
        self._budget, self._curve, self._show = budget, curve, show
        self.tracker = tracking.Tracker(config.track, folder.path, learner.steps)
        self._progress = Progress(folder.path, config, learner.steps)
        self._checkpoints = Interval(config.checkpoint_steps, learner.steps)
        self._evaluations = Interval(config.evaluation_interval, learner.steps)
        self._pace = Pace()

    def until(self, stop: StopRequest) -> None:
        """Works until the budget is used up or a stop is requested."""
        while self._budget.used < 1.0 and not stop.received:
            row = self._update()
            if self._evaluations.due(self._learner.steps):
                self._evaluate()
            if self._checkpoints.due(self._learner.steps):
                self.save()
            if self._show and self._pace.due():
                print(f"{100.0 * self._budget.used:3.0f} %  {text(row)}", flush=True)

    def _update(self) -> dict[str, float]:
        """One round of collecting and learning; its line of the learning curve."""
        learner = self._learner
        before, start = learner.simulator_seconds, time.perf_counter()
        learner.collect()
        simulating, collected = learner.simulator_seconds - before, time.perf_counter()
        self._budget.note(learner.steps)
        diagnostics = learner.learn(self._budget.used)
        whole = time.perf_counter() - start
        row = self._curve.row(learner.steps)
        self._folder.append_curve(row)
        shares = {
            "time/share_simulator": simulating / whole,
            "time/share_inference": (collected - start - simulating) / whole,
            "time/share_update": 1.0 - (collected - start) / whole,
        }
        self.tracker.write(learner.steps, tracking.of_row(row) | diagnostics | shares)
        return row

    def _evaluate(self) -> None:
        """Plays the policy as it is on validation fields, and keeps it if it is the best so far."""
        candidate = self._folder.path / "candidate.safetensors"
        self.write_policy(candidate)
        row = self._progress.play(Network(candidate, "policy"), self._learner.steps)
        if self._progress.last_is_best:
            candidate.replace(self._folder.best)
        candidate.unlink(missing_ok=True)
        self.tracker.write(self._learner.steps, {f"eval/{key}": row[key] for key in row if key != "steps"})

    def write_policy(self, path: Path) -> None:
        """Writes the policy as it is, with the configuration of the run."""
        about = self._config.model_dump(mode="json") | {"env": self._config.acting_env, "steps": self._learner.steps}
        files.write(path, self._learner.arrays(), about)

    def save(self) -> None:
        """Writes a checkpoint."""
        learner, state = self._learner, self._curve.state()
        self._folder.save_checkpoint(
            lambda path: learner.save(path, state), learner.steps, self._budget.seconds, learner.checkpoint
        )
