"""Measure the learner ppo against Stable-Baselines3's: the same hyper-parameters, fields and thread.

    python -m experiments.sb3_comparison
    python -m experiments.sb3_comparison --config field-hard --steps 400000 --repetitions 3

Runs alternate, so that other work on the machine weighs on all alike; the learner ppo runs once more with hidden
layers that learn in bfloat16, which Stable-Baselines3 does not have. Rates are environment steps per second of CPU
time, simulation and learning together. Each round of runs has its own seed, and all are then judged on fields for
choosing, so that the faster ones are seen to learn no worse.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snake_env.evaluation import rollout, seeds
from snake_env.policies.interface import Policy
from training import config as configs
from training.cli import answer
from training.config import RunConfig
from training.evaluation.loading import load_model
from training.learners import ppo, sb3
from training.runs import RunFolder, versions, write_json

LEARNERS: dict[str, tuple[Any, str, dict[str, bool]]] = {
    "SB3": (sb3.train, "sb3", {}),
    "ppo": (ppo.train, "ppo", {}),
    "ppo, bfloat16": (ppo.train, "ppo", {"bfloat16": True}),
}
"""By name: what trains, the learner's name, and options of its networks."""

FIELDS = 100


@dataclass
class Options:
    """What is compared.

    Args:
        config: A name in training/configs, or a file.
        steps: Environment steps of a run.
        repetitions: Runs of each learner.
        out: JSON file.
    """

    config: Path = Path("field-hard")
    steps: int = 100_000
    repetitions: int = 3
    out: Path = Path("runs/learners.json")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Runs the learners in turn, prints and writes rates and scores."""
    limits = {"num_threads": 1, "torch_threads": 1, "total_steps": args.steps, "max_minutes": None}
    values = configs.read(args.config) | limits
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in LEARNERS}
    with tempfile.TemporaryDirectory() as folder:
        for name in LEARNERS:  # warm-up: imports and allocations
            run(name, values | {"total_steps": 1}, Path(folder) / f"{name}-warm")
        for seed in range(args.repetitions):
            for name, of_learner in rows.items():
                row = run(name, values | {"seed": seed}, Path(folder) / f"{name}-{seed}")
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


def run(name: str, values: dict[str, Any], path: Path) -> dict[str, float]:
    """Trains with one learner and scores the policy."""
    train, learner, networks = LEARNERS[name]
    policy_values = values.get("policy", {}) | networks
    config = configs.parse(configs.LEARNERS[learner], values | {"learner": learner, "policy": policy_values})
    folder = RunFolder(path)
    folder.create(config)
    start = time.process_time()
    train(folder, config, False)
    seconds = time.process_time() - start
    steps = folder.read_curve()[-1]["steps"]
    return {"steps per CPU second": steps / seconds, **judge(load_model(folder.policy), config)}


def judge(policy: Policy, config: RunConfig) -> dict[str, float]:
    """Success rate and progress on validation fields."""
    episodes = rollout.run_episodes(policy, config.env_id, seeds.selection(FIELDS), 1, **config.env)
    return {"success": float(episodes["is_success"].mean()), "progress [m]": float(episodes["distance"].mean())}


if __name__ == "__main__":
    sys.exit(main())
