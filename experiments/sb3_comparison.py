"""Measure the learner ppo against Stable-Baselines3's, and where their time goes: the same hyper-parameters and thread.

    python -m experiments.sb3_comparison
    python -m experiments.sb3_comparison --config field-hard --steps 400000 --repetitions 5 --learners SB3 ppo

Runs alternate, so that other work on the machine weighs on all alike; the learner ppo runs once more with hidden
layers that learn in bfloat16, which Stable-Baselines3 does not have. Rates are environment steps per second of CPU
time, which is wall time on a thread of its own, simulation and learning together; shares are those of the simulator
(with what makes it an environment), of acting (inference and bookkeeping of rollouts) and of the update. Each round of
runs has its own seed, and all are then judged on validation fields; the differences from Stable-Baselines3 have
Student's intervals over the seeds, since the progress of a seed may be half of another's. The bound is the ratio of a
learner that spends time on nothing but the simulator and the matrix products of the update. Finished runs are kept:
after Ctrl-C, or with more repetitions, the same command continues.
"""

from __future__ import annotations

import json
import shutil
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

from snake_env._checks import names
from snake_env._files import write_json
from snake_env.evaluation import rollout, seeds
from snake_env.evaluation.statistics import student_interval
from snake_env.markdown import table
from snake_env.policies.interface import Policy
from snake_env.sb3 import SnakeVecEnv
from training import config as configs
from training import config_file
from training.cli import answer
from training.config import Count, PpoConfig, RunConfig
from training.evaluation.loading import load_model
from training.learners import ppo, sb3
from training.learners.mixture import Mixture
from training.runs import RunFolder, versions

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

RATE = "steps per CPU second"
SHARES = ("simulator", "acting", "update")
"""Shares of the CPU time."""
SCORES = ("success", "progress [m]")
"""On validation fields."""

FIELDS = 100
REPETITIONS = 30
"""Of a matrix product."""


@dataclass
class Options:
    """What is compared.

    Args:
        config: A name in training/configs, or a file.
        steps: Environment steps of a run.
        repetitions: Runs of each learner, with seeds 0, 1, ...
        learners: Names.
        out: Folder for everything.
    """

    config: Path = Path("field-hard")
    steps: Count = 100_000
    repetitions: Count = 20
    learners: tuple[str, ...] = tuple(LEARNERS)
    out: Path = Path("runs/sb3-comparison")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Runs the learners in turn, prints and writes rates and scores."""
    names("learners", args.learners, tuple(LEARNERS))
    limits = {"num_threads": 1, "torch_threads": 1, "total_steps": args.steps, "evaluations": 0, "track": "none"}
    values = config_file.read(args.config) | limits
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in args.learners}
    with tempfile.TemporaryDirectory() as folder:
        for name in rows:  # warm-up: imports and allocations
            run(name, values | {"total_steps": 1}, Path(folder) / name)
    for seed in range(args.repetitions):
        for name, of_learner in rows.items():
            row = kept(name, values | {"seed": seed}, args.out / f"{args.config.stem}-{args.steps}" / name / str(seed))
            of_learner.append(row)
            print(f"{name}, seed {seed}: " + ", ".join(f"{key} {value:.4g}" for key, value in row.items()), flush=True)
    print(text(rows))
    medians = {name: {key: statistics.median(row[key] for row in of) for key in of[0]} for name, of in rows.items()}
    if {"SB3", "ppo"} <= set(rows):
        print(bound(medians, configs.parse(PpoConfig, values | {"learner": "ppo"})))
    found = {"config": str(args.config), "steps": args.steps, "versions": versions(), "median": medians, "runs": rows}
    write_json(args.out / "sb3-comparison.json", found)
    return 0


def kept(name: str, values: dict[str, Any], path: Path) -> dict[str, float]:
    """The scores of a run, which is only done if it has none yet."""
    result = path / "scores.json"
    if not result.exists():
        shutil.rmtree(path, ignore_errors=True)  # a run that was stopped
        found = run(name, values, path)
        write_json(result, found)
    scores: dict[str, float] = json.loads(result.read_text())
    return scores


def text(rows: dict[str, list[dict[str, float]]]) -> str:
    """A Markdown table: medians of rates and shares, means of scores with Student's intervals over the seeds."""
    lines = []
    for name, of_learner in rows.items():
        rate, *shares = (statistics.median(row[key] for row in of_learner) for key in (RATE, *SHARES))
        scores = (interval([row[key] for row in of_learner], "") for key in SCORES)
        lines.append([name, f"{rate:,.0f}", *(f"{share:.2f}" for share in shares), *scores])
    return "\n".join([table(["learner", RATE, *SHARES, *SCORES], lines), "", *against_sb3(rows)])


def against_sb3(rows: dict[str, list[dict[str, float]]]) -> list[str]:
    """A sentence about each other learner: the ratio of rates, and differences of scores between equal seeds."""
    sentences = []
    for name in [one for one in rows if one != "SB3" and "SB3" in rows]:
        pairs = list(zip(rows[name], rows["SB3"], strict=True))
        rates = statistics.median(row[RATE] / of_sb3[RATE] for row, of_sb3 in pairs)
        parts = [f"{key} {interval([row[key] - of_sb3[key] for row, of_sb3 in pairs], '+')}" for key in SCORES]
        sentences.append(f"{name} against SB3: {rates:.2f} times the {RATE}, {', '.join(parts)}.")
    return sentences


def interval(values: list[float], sign: str) -> str:
    """Mean and Student's interval."""
    value, low, high = student_interval(values)
    return f"{value:{sign}.3f}" if len(values) < 3 else f"{value:{sign}.3f} [{low:{sign}.3f}, {high:{sign}.3f}]"


def bound(medians: dict[str, dict[str, float]], config: PpoConfig) -> str:
    """A sentence about the rate of a learner that does nothing but what both must."""
    ours, theirs = (1.0 / medians[name][RATE] for name in ("ppo", "SB3"))
    simulator, of_update = medians["ppo"]["simulator"] * ours, products(config)
    return (
        f"Of {1e6 * ours:.1f} us per step of a robot the simulator takes {1e6 * simulator:.1f} us, the matrix products "
        f"of the update {1e6 * of_update:.1f} us; Stable-Baselines3 takes {1e6 * theirs:.1f} us, so that "
        f"{theirs / (simulator + of_update):.2f} times its rate is the bound."
    )


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
    shares = (spent["step"] / seconds, (spent["collect"] - spent["step"]) / seconds, spent["learn"] / seconds)
    scores = judge(load_model(folder.policy), config)
    return {RATE: steps / seconds, **dict(zip(SHARES, shares, strict=True)), **scores}


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
    found = (episodes["is_success"].mean(), episodes["distance"].mean())
    return dict(zip(SCORES, map(float, found), strict=True))


if __name__ == "__main__":
    sys.exit(main())
