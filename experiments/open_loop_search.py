"""Can a task be done at all? A search over scripts of actions, start by start, without any feedback.

    python -m experiments.open_loop_search --env SnakePerturbed-v1 --options '{"perturbation": {"course": "table-7.3", \
"without": [3], "removed": 0, "shifted": 0}}'

CMA-ES (Hansen 2016) over actions that are held for a few seconds each. A script found proves that the start can be
solved; none found proves nothing.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import cma
import numpy as np
from numpy.typing import NDArray

from snake_env.evaluation import seeds
from snake_env.evaluation.rollout import make_env
from training.cli import answer
from training.config import Count, JsonObject

ROBOTS = 384
"""Scripts tried at a time."""
SEGMENTS = 8
"""Actions of a script; the last one is held to the end."""
FIRST_SPREAD = 0.7
"""Standard deviation of the actions at first."""


class Trial(NamedTuple):
    """What each script of a batch came to (n,)."""

    covered: NDArray[np.float64]
    success: NDArray[np.bool_]
    time: NDArray[np.float64]

    def score(self) -> NDArray[np.float64]:
        """Distance to the goal gained [m]; scripts that reach it come first, the quickest before the others."""
        return self.covered + np.where(self.success, 1.0 + 1.0 / (1.0 + self.time), 0.0)


@dataclass
class Options:
    """What is searched.

    Args:
        env: Environment.
        options: Keywords of the environment.
        starts: Episodes to solve, with validation seeds.
        rounds: Batches of scripts tried for each start.
        hold: Time for which an action is held [s].
    """

    env: str = "SnakePerturbed-v1"
    options: JsonObject = field(default_factory=dict)
    starts: Count = 10
    rounds: Count = 12
    hold: float = 3.0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, solve, __doc__, arguments)


def solve(args: Options) -> int:
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
    size = env.single_action_space.shape[0]
    options_of_cma = {"bounds": [-1.0, 1.0], "popsize": ROBOTS, "seed": seed % 2**32 + 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(np.zeros(SEGMENTS * size), FIRST_SPREAD, options_of_cma)
    best = None
    for _ in range(rounds):
        scripts = np.array(strategy.ask())
        trial = play(env, scripts.reshape(ROBOTS, SEGMENTS, size), seed, hold)
        score = trial.score()
        strategy.tell(list(scripts), list(-score))
        first = np.argsort(-score)[:1]
        found = Trial(trial.covered[first], trial.success[first], trial.time[first])
        if best is None or found.score()[0] > best.score()[0]:
            best = found
        if best.success[0]:
            break
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
