"""Stable-Baselines3's PPO over the native batch of robots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from tqdm import tqdm

import snake_env.sb3
from snake_env.evaluation import seeds
from training.budget import Budget, StopRequest
from training.config import Sb3Config
from training.learning_curve import LearningCurve, text
from training.runs import RunFolder

BAR_FORMAT = "{percentage:3.0f}%|{bar:25}| {elapsed}, {postfix}"


def train(folder: RunFolder, config: Sb3Config, bar: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start."""
    checkpoint = folder.latest()
    torch.set_num_threads(config.torch_threads)
    seconds = 0.0 if checkpoint is None else folder.seconds(checkpoint)
    budget = Budget(config.total_steps, config.max_minutes, seconds)
    steps_taken = 0 if checkpoint is None else int(checkpoint.stem)
    env = snake_env.sb3.make(config.env_id, config.num_envs, num_threads=config.num_threads, **config.env)
    env.seed(seeds.training(config.seed, steps_taken, config.num_envs))
    if checkpoint is None:
        model = _new_model(config, env, budget)
    else:
        with folder.resumed():
            model = _resumed_model(checkpoint, config, env, budget)
    model.set_logger(configure(str(folder.path / "tensorboard"), ["tensorboard"]))
    with StopRequest() as stop:
        callback = RunCallback(folder, config, budget, stop, bar)
        model.learn(config.total_steps - steps_taken, callback, reset_num_timesteps=checkpoint is None)
        callback.save()
        callback.close()
        if stop.received:
            print(f"saved after {model.num_timesteps} steps")
            return 130
    model.save(folder.path / "model.zip")
    folder.finish({"steps": model.num_timesteps, "seconds": round(budget.seconds, 1)})
    env.close()
    return 0


def _new_model(config: Sb3Config, env: Any, budget: Budget) -> PPO:
    return PPO(
        "MlpPolicy",
        env,
        seed=config.seed,
        device="cpu",
        policy_kwargs={"net_arch": list(config.policy.hidden), "log_std_init": config.policy.log_std},
        **_learner(config, budget),
    )


def _resumed_model(checkpoint: Path, config: Sb3Config, env: Any, budget: Budget) -> PPO:
    model = PPO.load(checkpoint, env, device="cpu", **_learner(config, budget))
    model.set_random_seed(config.seed + model.num_timesteps)
    return model


def _learner(config: Sb3Config, budget: Budget) -> dict[str, Any]:
    """Keywords of the learner; the learning rate falls with the share of the budget that is used."""
    values = config.ppo.model_dump()
    start, end = values.pop("learning_rate"), values.pop("final_learning_rate")
    return {**values, "learning_rate": lambda _: start * (1.0 - (1.0 - end) * budget.used)}


class RunCallback(BaseCallback):
    """Ends the run at the end of its budget or on request; saves checkpoints, the curve and shows the progress bar."""

    def __init__(self, folder: RunFolder, config: Sb3Config, budget: Budget, stop: StopRequest, bar: bool) -> None:
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
        self._folder.save_checkpoint(self.model.save, self.num_timesteps, self._budget.seconds, ".zip")
        self._last_save = self._budget.seconds

    def close(self) -> None:
        """Ends the progress bar."""
        self._bar.close()

    def _show(self, row: dict[str, float]) -> None:
        self._bar.update(100.0 * self._budget.used - self._bar.n)
        self._bar.set_postfix_str(text(row))
