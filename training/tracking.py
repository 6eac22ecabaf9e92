"""Where the numbers of a run go, beside the learning curve: TensorBoard, which needs no network.

Names are those of Stable-Baselines3, so that its runs and those of this package share the same pictures.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

FOLDER = "tensorboard"
"""Of the event files, in the folder of a run."""


class Tracker:
    """Receives the numbers of a run by name.

    Args:
        kind: "tensorboard" or "none", which forgets them.
        run: Folder of the run.
        steps: Environment steps taken before; what an earlier part of the run wrote beyond them is hidden.
    """

    def __init__(self, kind: str, run: Path, steps: int) -> None:
        self._writer: Any = None
        if kind == "tensorboard":
            from torch.utils.tensorboard import SummaryWriter

            make: Any = SummaryWriter
            self._writer = make(str(run / FOLDER), purge_step=steps + 1 if steps else None)

    def write(self, steps: int, values: Mapping[str, float]) -> None:
        """Numbers after so many environment steps."""
        if self._writer:
            for name, value in values.items():
                self._writer.add_scalar(name, value, steps)

    def close(self) -> None:
        """Writes what is left."""
        if self._writer:
            self._writer.close()


def of_row(row: Mapping[str, float]) -> dict[str, float]:
    """A line of the learning curve as numbers to track."""
    names = {"steps_per_second": "time/fps", "seconds": "time/time_elapsed", "return": "rollout/ep_rew_mean"}
    return {names.get(name, f"snake/{name}"): value for name, value in row.items() if name != "steps"}
