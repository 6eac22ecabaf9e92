"""Algorithms on one task with one budget: PPO of this package and of Stable-Baselines3, recurrent PPO, SAC and TQC.

    taskset -c 0 python -m experiments.algorithms
    python -m experiments.algorithms --algorithms SAC TQC --seeds 3

All learn from random weights in the environment and the number of steps of one configuration. Those of PPO share its
settings, recurrent PPO with an LSTM of as many units in the place of the first hidden layer; SAC and TQC have the
settings of :mod:`snake_env.zoo`, with the networks of the configuration and a gradient step per 32 environment steps.
Each seed's policy plays on held-out fields without exploration; the processor time includes simulation and learning,
on one thread. Finished seeds are kept: after Ctrl-C, or with more seeds, the same command continues; other steps,
fields or another configuration have a folder of their own. Prints Markdown, writes ``algorithms.json`` and
``learning-curves.png``.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback

import snake_env.sb3
from snake_env._checks import names
from snake_env._files import write_json
from snake_env.evaluation import rollout, seeds
from snake_env.evaluation.statistics import probability_of_improvement, student_interval
from snake_env.markdown import table
from snake_env.policies.interface import Policy, interface
from snake_env.zoo.sac import hyperparams as sac
from snake_env.zoo.tqc import hyperparams as tqc
from training import config as configs
from training.budget import Budget, Interval
from training.cli import answer
from training.config import Count, PpoConfig, Sb3Config
from training.evaluation import figures
from training.evaluation.loading import load_model
from training.learners import ppo, sb3
from training.learning_curve import LearningCurve
from training.runs import RunFolder, versions

FIELDS = 500
ROW_STEPS = 4096
"""Environment steps between two lines of a learning curve."""
STEPS_PER_GRADIENT = 32
"""Environment steps per gradient step of SAC and TQC."""


@dataclass
class Options:
    """What is compared.

    Args:
        config: A configuration of the learner ppo, a name in training/configs or a file.
        algorithms: Names.
        seeds: Runs of each.
        steps: Environment steps of a run; by default those of the configuration.
        fields: Held-out fields.
        out: Folder for everything.
    """

    config: Path = Path("algorithms")
    algorithms: tuple[str, ...] = ("ppo", "PPO (SB3)", "recurrent PPO", "SAC", "TQC")
    seeds: Count = 5
    steps: Count | None = None
    fields: Count = FIELDS
    out: Path = Path("runs/algorithms")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Trains what is not finished, seed by seed; prints and writes the table of all that is."""
    names("algorithms", args.algorithms, tuple(KINDS))
    torch.set_num_threads(1)
    config = configs.load_as(PpoConfig, args.config)
    config = config.with_changes(num_threads=1, torch_threads=1, total_steps=args.steps or config.total_steps)
    folder = args.out / f"{args.config.stem}-{config.total_steps}-{args.fields}"
    for seed in range(args.seeds):
        for name in args.algorithms:
            run = Run(name, seed, folder, args.fields)
            if not run.result.exists():
                run.work(config.with_changes(seed=seed))
            print(f"{name}, seed {seed}: {json.loads(run.result.read_text())}", flush=True)
    runs = {name: [Run(name, seed, folder, args.fields) for seed in range(args.seeds)] for name in KINDS}
    runs = {name: [run for run in of if run.result.exists()] for name, of in runs.items()}
    rows = {name: [json.loads(run.result.read_text()) for run in of] for name, of in runs.items() if of}
    print(text(rows, config.total_steps))
    about = {"config": str(args.config), "steps": config.total_steps, "fields": args.fields, "versions": versions()}
    write_json(args.out / "algorithms.json", about | {"runs": rows})
    curves = {name: [run.folder.read_curve() for run in runs[name]] for name in rows}
    figures.learning_curves(curves, args.out / "learning-curves.png")
    return 0


class Run:
    """One seed of an algorithm.

    Args:
        name: Of the algorithm.
        seed: Of the run.
        out: Folder of all runs with the same configuration, steps and fields.
        fields: Number of held-out fields.
    """

    def __init__(self, name: str, seed: int, out: Path, fields: int) -> None:
        self._train, self._fields = KINDS[name], fields
        self.folder = RunFolder(out / name / f"seed-{seed}")
        self.result = self.folder.path / "scores.json"

    def work(self, config: PpoConfig) -> None:
        """Trains, plays and notes the scores."""
        start = time.process_time()
        policy = self._train(self.folder, config)
        seconds = time.process_time() - start
        played = rollout.run_episodes(policy, config.env_id, seeds.held_out(self._fields), 1, **config.env)
        scores = {"success": float(played["is_success"].mean()), "speed [m/s]": float(played["speed"].mean())}
        found = scores | {"steps per CPU second": config.total_steps / seconds}
        write_json(self.result, found)


def own(folder: RunFolder, config: PpoConfig) -> Policy:
    """The PPO of this package."""
    folder.create(config)
    ppo.train(folder, config, show=False)
    return load_model(folder.policy)


def of_sb3(folder: RunFolder, config: PpoConfig) -> Policy:
    """The PPO of Stable-Baselines3."""
    shared = {name: value for name, value in config.model_dump(mode="json").items() if name in Sb3Config.model_fields}
    networks = {"hidden": config.policy.hidden, "log_std": config.policy.log_std}
    its = configs.parse(Sb3Config, shared | {"learner": "sb3", "policy": networks})
    folder.create(its)
    sb3.train(folder, its, bar=False)
    return load_model(folder.policy)


def recurrent(folder: RunFolder, config: PpoConfig) -> Policy:
    """PPO with an LSTM in actor and critic, of sb3-contrib."""
    first, *others = config.policy.hidden
    networks = {"lstm_hidden_size": first, "net_arch": others, "log_std_init": config.policy.log_std}
    return learned(
        folder, config, lambda budget: (RecurrentPPO, "MlpLstmPolicy", networks, sb3.settings(config, budget))
    )


def soft(kind: type, zoo: dict[str, dict[str, Any]]) -> Callable[[RunFolder, PpoConfig], Policy]:
    """SAC or TQC with the settings of the zoo."""

    def train(folder: RunFolder, config: PpoConfig) -> Policy:
        values = {name: value for name, value in zoo[config.env_id].items() if name not in NOT_THE_ALGORITHMS}
        values["gradient_steps"] = max(1, values["train_freq"] * config.num_envs // STEPS_PER_GRADIENT)
        return learned(folder, config, lambda _: (kind, "MlpPolicy", {"net_arch": list(config.policy.hidden)}, values))

    return train


NOT_THE_ALGORITHMS = ("policy", "policy_kwargs", "vec_env_wrapper", "n_envs", "n_timesteps")
"""Settings of the zoo that are not keywords of an algorithm, or that the configuration has."""

KINDS: dict[str, Callable[[RunFolder, PpoConfig], Policy]] = {
    "ppo": own,
    "PPO (SB3)": of_sb3,
    "recurrent PPO": recurrent,
    "SAC": soft(SAC, sac),
    "TQC": soft(TQC, tqc),
}
"""By name: what trains in a folder and returns the policy."""

Made = tuple[type, str, dict[str, Any], dict[str, Any]]
"""An algorithm, the name of its policies, and the keywords of both."""


def learned(folder: RunFolder, config: PpoConfig, make: Callable[[Budget], Made]) -> Policy:
    """The policy of an algorithm in the manner of Stable-Baselines3; it begins anew if it was stopped."""
    budget = Budget(config.total_steps)
    kind, name, networks, values = make(budget)
    env = snake_env.sb3.make(config.env_id, config.num_envs, num_threads=1, **config.env)
    env.seed(seeds.training(config.seed, 0, config.num_envs))
    folder.create(config)
    folder.curve.unlink(missing_ok=True)
    model = kind(name, env, seed=config.seed, device="cpu", policy_kwargs=networks, **values)
    model.learn(config.total_steps, Curve(folder, budget))
    env.close()
    return Model(model, interface(config.env))


class Curve(BaseCallback):
    """Notes the steps taken, and writes the learning curve of a run."""

    def __init__(self, folder: RunFolder, budget: Budget) -> None:
        super().__init__()
        self._folder, self._budget, self._curve = folder, budget, LearningCurve(budget)
        self._rows = Interval(ROW_STEPS)

    def _on_step(self) -> bool:
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            if done:
                self._curve.note(info["episode"]["r"], info)
        self._budget.note(self.num_timesteps)
        if self._rows.due(self.num_timesteps):
            self._on_training_end()
        return True

    def _on_training_end(self) -> None:
        self._folder.append_curve(self._curve.row(self.num_timesteps))


class Model:
    """A model in the manner of Stable-Baselines3 as a policy without exploration noise, recurrent or not."""

    name = "policy"

    def __init__(self, model: Any, env_options: dict[str, Any]) -> None:
        self.env_options = env_options
        self._model = model

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """All episodes begin."""
        self._state, self._begins = None, np.ones(num_envs, np.bool_)

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """The episodes of the robots in ``rows`` begin."""
        self._begins |= rows

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        action, self._state = self._model.predict(observation, self._state, self._begins, deterministic=True)
        self._begins[:] = False
        return np.asarray(action)


FEWEST = 3
"""Seeds below which there is no interval."""


def text(rows: dict[str, list[dict[str, float]]], steps: int) -> str:
    """Means over the seeds with Student's intervals, and who is better than the first."""
    first = next(iter(rows))
    heads = ["algorithm", "seeds", "success", "seed by seed", "speed [m/s]", f"better than {first} with probability"]
    lines = []
    for name, of_seeds in rows.items():
        success, speed = ([row[key] for row in of_seeds] for key in ("success", "speed [m/s]"))
        rate = float(np.median([row["steps per CPU second"] for row in of_seeds]))
        each = ", ".join(f"{value:.3f}" for value in success)
        chance = "-"
        if name != first and len(of_seeds) >= FEWEST:
            better = probability_of_improvement([success], [[row["success"] for row in rows[first]]])
            chance = f"{better.value:.2f} [{better.low:.2f}, {better.high:.2f}]"
        lines.append([name, len(of_seeds), _mean(success), each, _mean(speed), chance, f"{rate:,.0f}"])
    return f"{steps:,} steps.\n\n" + table([*heads, "steps per CPU second"], lines)


def _mean(values: list[float]) -> str:
    value, low, high = student_interval(values)
    return f"{value:.3f} [{low:.3f}, {high:.3f}]" if len(values) >= FEWEST else f"{value:.3f}"


if __name__ == "__main__":
    sys.exit(main())
