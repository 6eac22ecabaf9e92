"""Measure the learner ppo against Stable-Baselines3's, and where their time goes: the same hyper-parameters and thread.

    python -m experiments.sb3_comparison
    python -m experiments.sb3_comparison --config field-hard --steps 400000 --repetitions 3

Runs alternate, so that other work on the machine weighs on all alike; the learner ppo runs once more with hidden
layers that learn in bfloat16, which Stable-Baselines3 does not have. Rates are environment steps per second of CPU
time, which is wall time on a thread of its own, simulation and learning together; shares are those of the simulator
(with what makes it an environment), of acting (inference and bookkeeping of rollouts) and of the update. Each round of
runs has its own seed, and all are then judged on validation fields, so that the faster ones are seen to learn no worse.
The bound is the ratio of a learner that spends time on nothing but the simulator and the matrix products of the update.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO
from torch import nn

from snake_env.evaluation import rollout, seeds
from snake_env.policies.interface import Policy
from snake_env.sb3 import SnakeVecEnv
from training import config as configs
from training.cli import answer
from training.config import PpoConfig, RunConfig
from training.evaluation.loading import load_model
from training.learners import ppo, sb3
from training.learners.mixture import Mixture
from training.runs import RunFolder, versions, write_json

LEARNERS: dict[str, tuple[Any, str, dict[str, bool]]] = {
    "SB3": (sb3.train, "sb3", {}),
    "ppo": (ppo.train, "ppo", {}),
    "ppo, bfloat16": (ppo.train, "ppo", {"bfloat16": True}),
}
"""By name: what trains, the learner's name, and options of its networks."""

PARTS: dict[str, dict[str, tuple[type, str]]] = {
    "sb3": {
        "step": (SnakeVecEnv, "step_wait"),
        "collect": (PPO, "collect_rollouts"),
        "learn": (PPO, "train"),
    },
    "ppo": {
        "step": (Mixture, "step"),
        "collect": (ppo.Learner, "collect"),
        "learn": (ppo.Learner, "learn"),
    },
}
"""By learner the methods whose time is measured."""

FIELDS = 100
REPETITIONS = 30
"""Of a matrix product."""


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
    limits = {"num_threads": 1, "torch_threads": 1, "total_steps": args.steps, "evaluations": 0, "track": "none"}
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
    seconds = {name: 1.0 / rate for name, rate in rates.items()}
    simulator = summary["ppo"]["share of simulator"] * seconds["ppo"]
    of_update = products(configs.parse(PpoConfig, values | {"learner": "ppo"}))
    print(f"simulator and products of the update: {1e6 * simulator:.1f} + {1e6 * of_update:.1f} us per step of a robot")
    print(
        f"SB3 {1e6 * seconds['SB3']:.1f} us, so that {seconds['SB3'] / (simulator + of_update):.2f} times is the bound"
    )
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
    spent: dict[str, float] = {}
    with ExitStack() as stack:
        for part, (owner, method) in PARTS[learner].items():
            stack.enter_context(timed(owner, method, spent, part))
        start = time.process_time()
        train(folder, config, False)
        seconds = time.process_time() - start
    steps = folder.read_curve()[-1]["steps"]
    shares = {
        "share of simulator": spent["step"] / seconds,
        "share of acting": (spent["collect"] - spent["step"]) / seconds,
        "share of update": spent["learn"] / seconds,
    }
    return {"steps per CPU second": steps / seconds, **shares, **judge(load_model(folder.policy), config)}


def products(config: PpoConfig) -> float:
    """CPU time that the matrix products of an update take per step of a robot [s]: least of some repetitions."""
    learner = ppo.Learner(config, 0, lambda *episode: None)
    learner.close()
    count, least = config.ppo.batch_size, 0.0
    for network in (learner.agent.actor, learner.agent.critic):
        layers = [layer.weight.detach() for layer in network.modules() if isinstance(layer, nn.Linear)]
        for k, weight in enumerate(layers):
            inputs, gradient = torch.ones(count, weight.shape[1]), torch.ones(count, weight.shape[0])
            least += fastest(partial(torch.mm, inputs, weight.t())) + fastest(partial(torch.mm, gradient.t(), inputs))
            least += fastest(partial(torch.mm, gradient, weight)) if k else 0.0  # observations have no gradient
    return least * config.ppo.n_epochs / count


def fastest(work: Callable[[], object]) -> float:
    """CPU time of a call [s], least of some batches of them."""
    taken = []
    for _ in range(REPETITIONS):
        start = time.process_time()
        for _ in range(REPETITIONS):
            work()
        taken.append((time.process_time() - start) / REPETITIONS)
    return min(taken)


@contextmanager
def timed(owner: type, method: str, spent: dict[str, float], part: str) -> Iterator[None]:
    """Adds the CPU time in a method of a class to ``spent[part]`` [s]."""
    original = getattr(owner, method)
    spent[part] = 0.0

    def around(*arguments: Any, **keywords: Any) -> Any:
        start = time.process_time()
        try:
            return original(*arguments, **keywords)
        finally:
            spent[part] += time.process_time() - start

    setattr(owner, method, around)
    try:
        yield
    finally:
        setattr(owner, method, original)


def judge(policy: Policy, config: RunConfig) -> dict[str, float]:
    """Success rate and progress on validation fields."""
    episodes = rollout.run_episodes(policy, config.env_id, seeds.selection(FIELDS), 1, **config.env)
    return {"success": float(episodes["is_success"].mean()), "progress [m]": float(episodes["distance"].mean())}


if __name__ == "__main__":
    sys.exit(main())
