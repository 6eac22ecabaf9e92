"""Stable-Baselines3's PPO over the native batch of robots."""

from __future__ import annotations

import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, configure

import snake_env.sb3
from snake_env._files import replace
from snake_env.evaluation import seeds
from snake_env.policies.foreign import Model
from snake_env.policies.interface import interface
from snake_env.policies.policy_card import PolicyCard
from training import tracking
from training.budget import Budget, Interval, StopRequest
from training.config import CurriculumConfig, Sb3Config
from training.learning_curve import LearningCurve, text
from training.pace import Pace
from training.progress import Progress
from training.runs import RunFolder

WORLD = "robots.pkl"
"""Robots and random states in the zip file of a checkpoint."""


def train(folder: RunFolder, config: Sb3Config, show: bool = True) -> int:
    """Trains from the folder's latest checkpoint, or from the start."""
    checkpoint = folder.latest()
    torch.set_num_threads(config.torch_threads)
    seconds = 0.0 if checkpoint is None else folder.seconds(checkpoint)
    steps = 0 if checkpoint is None else int(checkpoint.stem)
    budget = Budget(config.total_steps, steps, seconds)
    env = snake_env.sb3.make(config.env_id, config.num_envs, num_threads=config.num_threads, **config.env)
    env.seed(seeds.training(config.seed, 0, config.num_envs))
    curve = LearningCurve(budget, steps)
    if checkpoint is None:
        model = new_model(config, env, budget)
    else:
        with folder.resumed():
            model = _resumed_model(checkpoint, config, env, budget, curve)
    model.set_logger(_logger(folder, config))
    with StopRequest() as stop:
        callback = RunCallback(folder, config, budget, curve, stop, show)
        if budget.used < 1.0:
            model.learn(config.total_steps - steps, callback, reset_num_timesteps=checkpoint is None)
        callback.end(model)
        if stop.received:
            latest = folder.latest()
            print(f"saved after {0 if latest is None else int(latest.stem)} steps")
            return 130
    replace(folder.path / "model.zip", model.save)
    folder.finish({"steps": model.num_timesteps, "seconds": round(budget.seconds, 1)})
    env.close()
    return 0


def new_model(config: Sb3Config, env: Any, budget: Budget) -> PPO:
    """PPO with random weights."""
    return PPO(
        "MlpPolicy",
        env,
        seed=config.seed,
        device="cpu",
        policy_kwargs={"net_arch": list(config.policy.hidden), "log_std_init": config.policy.log_std},
        **settings(config, budget),
    )


def settings(config: CurriculumConfig, budget: Budget) -> dict[str, Any]:
    """Keywords of PPO; the learning rate falls with the share of the steps that are taken."""
    values = config.ppo.model_dump()
    start, end = values.pop("learning_rate"), values.pop("final_learning_rate")
    return {**values, "learning_rate": lambda _: start * (1.0 - (1.0 - end) * budget.used)}


def _logger(folder: RunFolder, config: Sb3Config) -> Logger:
    return configure(str(folder.path / tracking.FOLDER), ["tensorboard"] if config.track == "tensorboard" else [])


def save(model: PPO, curve: LearningCurve, path: Path) -> None:
    """Writes a checkpoint between two rollouts: the model, and what continues its robots bit for bit."""
    venv = _venv(model)
    world = {
        "robots": venv.env.get_state(),
        "running_totals": venv.running_totals,
        "torch": torch.get_rng_state(),
        "numpy": np.random.get_state(),  # noqa: NPY002 - Stable-Baselines3 draws from it
        "curve": curve.state(),
    }
    model.save(path)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(WORLD, pickle.dumps(world))


def _resumed_model(path: Path, config: Sb3Config, env: Any, budget: Budget, curve: LearningCurve) -> PPO:
    model = PPO.load(path, env, device="cpu", force_reset=False, **settings(config, budget))
    with zipfile.ZipFile(path) as archive:
        world = pickle.loads(archive.read(WORLD))
    venv = _venv(model)
    venv.env.set_state(world["robots"])
    venv.running_totals = world["running_totals"]
    torch.set_rng_state(world["torch"])
    np.random.set_state(world["numpy"])  # noqa: NPY002
    curve.restore(world["curve"])
    return model


def _venv(model: PPO) -> snake_env.sb3.SnakeVecEnv:
    venv = model.get_env()
    assert isinstance(venv, snake_env.sb3.SnakeVecEnv)
    return venv


class RunCallback(BaseCallback):
    """Ends the run on request; evaluates, saves checkpoints and the curve, shows progress.

    Checkpoints are written between an update and the next rollout, so that nothing of a rollout is lost.
    """

    def __init__(
        self,
        folder: RunFolder,
        config: Sb3Config,
        budget: Budget,
        curve: LearningCurve,
        stop: StopRequest,
        show: bool,
    ) -> None:
        super().__init__()
        self._folder, self._config, self._budget, self._curve, self._stop = folder, config, budget, curve, stop
        self._show, self._pace = show, Pace()
        self._stopping = False

    def _on_training_start(self) -> None:
        steps = self.num_timesteps
        self._progress = Progress(self._folder.path, self._config, steps)
        self._checkpoints = Interval(self._config.checkpoint_steps, steps)
        self._evaluations = Interval(self._config.evaluation_interval, steps)
        self._begun_at = steps

    def _on_rollout_start(self) -> None:
        """After an update, before the next rollout."""
        if self._config.curriculum:
            layout = self.training_env.get_attr("layout", [0])[0]
            hardest = float(layout["config"]["difficulty"])
            self.training_env.env_method("set_difficulty", self._config.difficulty(self._budget.used, hardest))
        self._stopping = self._stop.received
        if self.num_timesteps > self._begun_at:
            self._after_update(self.model)

    def _after_update(self, model: Any) -> None:
        if self._evaluations.due(model.num_timesteps):
            self._evaluate(model)
        if self._checkpoints.due(model.num_timesteps) or self._stopping:
            self._save(model)

    def _on_step(self) -> bool:
        if self._stopping:  # before anything of this step is noted: the checkpoint is of the state before it
            return False
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            if done:
                self._curve.note(info["episode"]["r"], info)
        self._budget.note(self.num_timesteps)
        return True

    def _on_rollout_end(self) -> None:
        """Between the collection of samples and the update."""
        row = self._curve.row(self.num_timesteps)
        for key, value in tracking.of_row(row).items():
            if key.startswith("snake/"):  # the others are its own
                self.logger.record(key, value)
        self._folder.append_curve(row)
        if self._show and self._pace.due():
            print(f"{100.0 * self._budget.used:3.0f} %  {text(row)}", flush=True)

    def _evaluate(self, model: Any) -> None:
        row = self._progress.play(Model(model, PolicyCard("policy"), interface(self._config.env)), model.num_timesteps)
        for key, value in row.items():
            if key != "steps":
                self.logger.record(f"eval/{key}", value)
        self.logger.dump(model.num_timesteps)
        if self._progress.last_is_best:
            replace(self._folder.path / "best.zip", model.save)

    def _save(self, model: Any) -> None:
        self._folder.save_checkpoint(
            lambda path: save(model, self._curve, path), model.num_timesteps, self._budget.seconds, ".zip"
        )

    def end(self, model: PPO) -> None:
        """After the last update; a run that was stopped has saved when it stopped."""
        if not self._stopping and self._budget.used >= 1.0:
            if hasattr(self, "_evaluations"):
                self._after_update(model)
            self._save(model)
        self.logger.close()
