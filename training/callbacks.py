"""What a training run does beside learning: keeps its budget, its checkpoints and its learning curve."""

from __future__ import annotations

import signal
import time
from collections import deque
from types import FrameType
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from training.config import Config
from training.run_folder import RunFolder

EPISODES = 200
"""Finished episodes over which the learning curve is averaged."""


class Budget:
    """Steps and wall time that a run may use; counts the time of earlier parts of a resumed run.

    Args:
        config: gives ``total_steps`` and ``max_minutes``.
        seconds: wall time used before.
    """

    def __init__(self, config: Config, seconds: float) -> None:
        self._total_steps = config.total_steps
        self._max_seconds = float("inf") if config.max_minutes is None else 60.0 * config.max_minutes
        self._start = time.monotonic() - seconds
        self._steps = 0

    @property
    def seconds(self) -> float:
        """Wall time used [s]."""
        return time.monotonic() - self._start

    @property
    def out_of_time(self) -> bool:
        """The wall time is used up."""
        return self.seconds >= self._max_seconds

    def note(self, steps: int) -> None:
        """Takes note of the steps taken so far."""
        self._steps = steps

    @property
    def used(self) -> float:
        """Share of the budget that is used up, in [0, 1]."""
        return min(1.0, max(self._steps / self._total_steps, self.seconds / self._max_seconds))


class StopRequest:
    """Ctrl-C or a termination signal asks the run to save and stop; a second one interrupts at once."""

    def __init__(self) -> None:
        self.received = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if self.received:
            raise KeyboardInterrupt
        self.received = True
        print("\nstopping after this step; the run will be saved", flush=True)


class Keeper(BaseCallback):
    """Ends the run on time or on request, saves checkpoints, writes the curve and draws the progress bar."""

    def __init__(self, folder: RunFolder, config: Config, budget: Budget, stop: StopRequest, bar: bool) -> None:
        super().__init__()
        self._folder = folder
        self._budget = budget
        self._stop = stop
        self._interval = config.checkpoint_seconds
        self._last_save = budget.seconds
        self._last_rate = (budget.seconds, 0)
        self._ended: deque[dict[str, float]] = deque(maxlen=EPISODES)
        self._bar = tqdm(total=100.0, unit="%", disable=not bar, bar_format=BAR_FORMAT)

    def _on_training_start(self) -> None:
        self._last_rate = (self._budget.seconds, self.num_timesteps)

    def _on_step(self) -> bool:
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            if done:
                self._ended.append({"return": info["episode"]["r"], **{key: float(info[key]) for key in SIGNALS}})
        self._budget.note(self.num_timesteps)
        return not (self._budget.out_of_time or self._stop.received)

    def _on_rollout_end(self) -> None:
        """Between the collection of samples and the update."""
        row = self._row()
        for key, value in row.items():
            self.logger.record(f"snake/{key}", value)
        self._folder.append_curve(row)
        self._show(row)
        if self._budget.seconds - self._last_save >= self._interval:
            self.save()

    def save(self) -> None:
        """Saves a checkpoint."""
        self._folder.save_checkpoint(self.model.save, self.num_timesteps, self._budget.seconds)
        self._last_save = self._budget.seconds

    def close(self) -> None:
        """Ends the progress bar."""
        self._bar.close()

    def _row(self) -> dict[str, float]:
        seconds, steps = self._budget.seconds, self.num_timesteps
        rate = (steps - self._last_rate[1]) / max(seconds - self._last_rate[0], 1e-9)
        self._last_rate = (seconds, steps)
        row = {"steps": steps, "seconds": round(seconds, 2), "steps_per_second": round(rate)}
        for key in ("return", *SIGNALS):
            if self._ended:
                row[key] = round(float(np.mean([episode[key] for episode in self._ended])), 4)
        return row

    def _show(self, row: dict[str, float]) -> None:
        self._bar.update(100.0 * self._budget.used - self._bar.n)
        self._bar.set_postfix_str(
            f"{row['steps'] / 1e6:.2f} M steps, {row['steps_per_second'] / 1e3:.1f} k/s, "
            f"success {row.get('is_success', 0.0):.2f}, distance {row.get('distance', 0.0):.2f} m"
        )


BAR_FORMAT = "{percentage:3.0f}%|{bar:25}| {elapsed}, {postfix}"

SIGNALS = ("is_success", "distance", "speed", "jam_ratio", "left_corridor")
"""Signals of an episode's last step that the curve shows."""
