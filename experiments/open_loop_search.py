"""Can a task be done at all? A search over scripts of actions, start by start, without any feedback.

    python -m experiments.open_loop_search --env SnakePerturbed-v0 --options '{"perturbation": {"course": "table-7.3", \
"without": [3], "removed": 0, "shifted": 0}}'

The cross-entropy method over actions that are held for a few seconds each. A script found proves that the start can be
solved; none found proves nothing.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from training import seeds
from training.cli import answer, help_format, json_mapping
from training.rollout import make_env

ROBOTS = 384
"""Scripts tried at a time."""
ELITE = 20
"""Best of them, from which the next ones are drawn."""
SEGMENTS = 8
"""Actions of a script; the last one goes on to the end."""
FIRST_SPREAD, LEAST_SPREAD = 0.7, 0.1
"""Standard deviation of the actions at first, and what is added to that of the elite."""


class Trial(NamedTuple):
    """What each script of a batch came to (n,)."""

    covered: NDArray[np.float64]
    success: NDArray[np.bool_]
    time: NDArray[np.float64]

    def score(self) -> NDArray[np.float64]:
        """Distance to the goal gained [m]; scripts that reach it come first, the quickest before the others."""
        return self.covered + np.where(self.success, 1.0 + 1.0 / (1.0 + self.time), 0.0)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    cli = argparse.ArgumentParser("experiments.open_loop_search", description=__doc__, formatter_class=help_format)
    cli.add_argument("--env", default="SnakePerturbed-v0", help="environment id")
    cli.add_argument("--options", type=json_mapping, default={}, help="keywords of the environment, as JSON")
    cli.add_argument("--starts", type=int, default=10, help="episodes to solve, with seeds meant for choosing")
    cli.add_argument("--rounds", type=int, default=12, help="batches of scripts tried for each start")
    cli.add_argument("--hold", type=float, default=3.0, help="time for which an action is held [s]")
    return answer(cli, solve, arguments)


def solve(args: argparse.Namespace) -> int:
    """Searches a script for each start."""
    solved = 0
    for seed in seeds.selection(args.starts):
        best = search(args.env, args.options, seed, args.rounds, args.hold)
        solved += bool(best.success[0])
        print(f"start {seed}: {best.covered[0]:.2f} m, {'solved' if best.success[0] else 'not solved'}", flush=True)
    print(f"{solved} of {args.starts} starts solved by a script")
    return 0


def search(env_id: str, options: dict[str, Any], seed: int, rounds: int, hold: float) -> Trial:
    """The best script found for one start, as a trial of one."""
    env = make_env(env_id, ROBOTS, **options)
    rng = np.random.default_rng(seed)
    size = env.single_action_space.shape[0]
    mean, spread = np.zeros((SEGMENTS, size)), np.full((SEGMENTS, size), FIRST_SPREAD)
    elite = np.zeros((1, SEGMENTS, size))
    best = None
    for _ in range(rounds):
        drawn = rng.normal(mean, spread, (ROBOTS - len(elite), SEGMENTS, size))
        scripts = np.clip(np.concatenate([elite, drawn]), -1.0, 1.0)
        trial = play(env, scripts, seed, hold)
        order = np.argsort(-trial.score())
        first = order[:1]
        best = Trial(trial.covered[first], trial.success[first], trial.time[first])
        if best.success[0]:
            break
        elite = scripts[order[:ELITE]]
        mean, spread = elite.mean(axis=0), elite.std(axis=0) + LEAST_SPREAD
    env.close()
    assert best is not None
    return best


def play(env: Any, scripts: NDArray[np.float64], seed: int, hold: float) -> Trial:
    """Plays each script from the same start to the end of its episode."""
    n = len(scripts)
    env.reset(seed=[seed] * n)
    running = np.ones(n, np.bool_)
    trial = Trial(np.zeros(n), np.zeros(n, np.bool_), np.zeros(n))
    step = 0
    while running.any():
        segment = min(int(step * env.unwrapped.control_period / hold), SEGMENTS - 1)
        _, _, terminated, truncated, infos = env.step(scripts[:, segment].astype(np.float32))
        for kept, name in zip(trial, ("distance", "is_success", "time"), strict=True):
            kept[running] = infos[name][running]
        running &= ~(terminated | truncated)
        step += 1
    return trial


if __name__ == "__main__":
    sys.exit(main())
