"""What a training run does beside learning: keeps its checkpoints and its learning curve."""

from __future__ import annotations

from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from training.budget import Budget, StopRequest
from training.config import Config
from training.learning_curve import LearningCurve, text
from training.runs import RunFolder


class Keeper(BaseCallback):
    """Ends the run on time or on request, saves checkpoints, writes the curve and draws the progress bar."""

    def __init__(self, folder: RunFolder, config: Config, budget: Budget, stop: StopRequest, bar: bool) -> None:
        super().__init__()
        self._folder = folder
        self._budget = budget
        self._stop = stop
        self._config = config
        self._interval = config.checkpoint_seconds
        self._last_save = budget.seconds
        self._bar = tqdm(total=100.0, unit="%", disable=not bar, bar_format=BAR_FORMAT)

    def _on_training_start(self) -> None:
        self._curve = LearningCurve(self._budget, self.num_timesteps)

    def _on_rollout_start(self) -> None:
        """Sets the difficulty of the episodes that begin from now on."""
        if self._config.curriculum:
            layout = self.training_env.get_attr("layout", [0])[0]
            hardest = float(layout["config"]["difficulty"])
            self.training_env.env_method("set_difficulty", self._config.difficulty(self._budget.used, hardest))

    def _on_step(self) -> bool:
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            if done:
                self._curve.note(info["episode"]["r"], info)
        self._budget.note(self.num_timesteps)
        return not (self._budget.out_of_time or self._stop.received)

    def _on_rollout_end(self) -> None:
        """Between the collection of samples and the update."""
        row = self._curve.row(self.num_timesteps)
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

    def _show(self, row: dict[str, float]) -> None:
        self._bar.update(100.0 * self._budget.used - self._bar.n)
        self._bar.set_postfix_str(text(row))


BAR_FORMAT = "{percentage:3.0f}%|{bar:25}| {elapsed}, {postfix}"
