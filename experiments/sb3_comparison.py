"""Measure the lean PPO against Stable-Baselines3's: the same hyper-parameters, fields and thread.

    python -m experiments.sb3_comparison
    python -m experiments.sb3_comparison --config field-hard --steps 400000 --repetitions 3

Runs alternate, so that other work on the machine weighs on all alike; the lean learner runs once more with hidden
layers that learn in bfloat16, which Stable-Baselines3 does not have. Rates are environment steps per second of CPU
time, simulation and learning together. Each round of runs has its own seed, and all are then judged on fields for
choosing, so that the faster ones are seen to learn no worse.
"""

from __future__ import annotations

import argparse
import dataclasses
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from training import config as configs
from training import rollout, seeds
from training.cli import answer, help_format
from training.config import Config
from training.learners import ppo, sb3
from training.policies.interface import Policy
from training.policies.network import Network
from training.policies.sb3_model import Model
from training.runs import RunFolder, versions, write_json

LEARNERS: dict[str, tuple[Any, str, str, Any, bool]] = {
    "SB3": (sb3.train, "model.zip", ".zip", Model, False),
    "lean": (ppo.train, ppo.POLICY, ".pt", Network, False),
    "lean, bfloat16": (ppo.train, ppo.POLICY, ".pt", Network, True),
}
"""By name: what trains, the names of its files, what plays them, and whether hidden layers learn in bfloat16."""

FIELDS = 100


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.learners", description=__doc__, formatter_class=help_format)
    cli.add_argument("--config", type=Path, default=Path("field-hard"), help="a name in training/configs, or a file")
    cli.add_argument("--steps", type=int, default=100_000, help="environment steps of a run")
    cli.add_argument("--repetitions", type=int, default=3, help="runs of each learner")
    cli.add_argument("--out", type=Path, default=Path("runs/learners.json"), help="JSON file")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), compare, arguments)


def compare(args: argparse.Namespace) -> int:
    """Runs the learners in turn, prints and writes rates and scores."""
    config = dataclasses.replace(
        configs.load(args.config), num_threads=1, torch_threads=1, total_steps=args.steps, max_minutes=None
    )
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in LEARNERS}
    with tempfile.TemporaryDirectory() as folder:
        for name in LEARNERS:  # warm-up: imports and allocations
            run(name, dataclasses.replace(config, total_steps=1), Path(folder) / f"{name}-warm")
        for seed in range(args.repetitions):
            for name, of_learner in rows.items():
                row = run(name, dataclasses.replace(config, seed=seed), Path(folder) / f"{name}-{seed}")
                of_learner.append(row)
                print(
                    f"{name}, seed {seed}: " + ", ".join(f"{key} {value:.4g}" for key, value in row.items()), flush=True
                )
    summary = {name: {key: statistics.median(row[key] for row in of) for key in of[0]} for name, of in rows.items()}
    rates = {name: median["steps per CPU second"] for name, median in summary.items()}
    ratios = {name: rate / rates["SB3"] for name, rate in rates.items() if name != "SB3"}
    for name, ratio in ratios.items():
        print(f"{name} / SB3: {ratio:.2f} times the steps per CPU second")
    args.out.parent.mkdir(parents=True, exist_ok=True)
    write_json(
        args.out,
        {"config": str(args.config), "versions": versions(), "median": summary, "ratios": ratios, "runs": rows},
    )
    return 0


def run(name: str, config: Config, path: Path) -> dict[str, float]:
    """Trains with one learner and judges what came out."""
    train, model, checkpoint, load, bfloat16 = LEARNERS[name]
    config = dataclasses.replace(config, policy=dataclasses.replace(config.policy, bfloat16=bfloat16))
    folder = RunFolder(path, model, checkpoint)
    folder.create(config)
    start = time.process_time()
    train(folder, config, False)
    seconds = time.process_time() - start
    steps = folder.read_curve()[-1]["steps"]
    policy: Any = load(folder.model, name)
    return {"steps per CPU second": steps / seconds, **judge(policy, config)}


def judge(policy: Policy, config: Config) -> dict[str, float]:
    """Success rate and progress on fields for choosing."""
    episodes = rollout.run_episodes(policy, config.env_id, seeds.selection(FIELDS), 1, **config.env)
    return {"success": float(episodes["is_success"].mean()), "progress [m]": float(episodes["distance"].mean())}


if __name__ == "__main__":
    sys.exit(main())
