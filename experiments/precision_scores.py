"""Scores of the shipped policies at every precision, on the same test scenes.

    python -m experiments.precision_scores --scenes 200

The last two columns compare with the precision "fine", in percent: speed, and the actuators' work for all the way made,
on the scenes in which the robot reaches the goal at both; brackets are 95 % bootstrap intervals over scenes. Prints
Markdown.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

import snake_env
from snake_env.evaluation.protocol import evaluate
from snake_env.evaluation.rollout import Episodes
from snake_env.markdown import table

PLAYED = (
    ("general", "field-hard"),
    ("general", "corridor"),
    ("general", "maze"),
    ("field-hard", "field-hard"),
    ("corridor", "corridor"),
    ("perturbed", "perturbed"),
    ("spatial", "spatial-open"),
    ("spatial-field", "spatial-field"),
)
"""Policies and tasks of the benchmark."""
PRECISIONS = ("fast", "default", "fine")
HEAD = ("policy", "task", "precision", "success", "speed [m/s]", "cost of transport", "speed [%]", "cost [%]")
DRAWS = 2000


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--scenes", type=int, default=200)
    cli.add_argument("--policies", nargs="+", choices=sorted({name for name, _ in PLAYED}))
    args = cli.parse_args(arguments)
    rows: list[tuple[str, ...]] = []
    for name, task in PLAYED:
        if args.policies is None or name in args.policies:
            rows += compared(name, task, args.scenes)
            print(f"{name}, {task}: played", flush=True)
    print(table(HEAD, rows))
    return 0


def compared(name: str, task: str, scenes: int) -> list[tuple[str, ...]]:
    """Rows of a policy in a task."""
    policy = snake_env.load_policy(name)
    played = [evaluate(policy, task, scenes=scenes, precision=precision) for precision in PRECISIONS]
    fine = played[-1].episodes
    rows = []
    for precision, one in zip(PRECISIONS, played, strict=True):
        shown = [f"{one.scores[key].value:.3f}" for key in ("success", "speed", "cost_of_transport")]
        changes = ["-", "-"] if one.episodes is fine else [_shown(*pair) for pair in changed(one.episodes, fine)]
        rows.append((f"`{name}`", task, precision, *shown, *changes))
    return rows


def changed(episodes: Episodes, fine: Episodes, draws: int = DRAWS) -> list[tuple[float, ...]]:
    """Change of mean speed and of total cost of transport against ``fine``, each with its interval [%]."""
    both = np.asarray(episodes["is_success"], bool) & np.asarray(fine["is_success"], bool)
    scenes = np.flatnonzero(both)
    sampled = np.random.default_rng(0).choice(scenes, (draws, len(scenes)))
    found = []
    for of in (_speed, _cost):
        ratios = [100.0 * (of(episodes, which) / of(fine, which) - 1.0) for which in (scenes[None], sampled)]
        found.append((float(ratios[0][0]), *(float(x) for x in np.quantile(ratios[1], (0.025, 0.975)))))
    return found


def _speed(episodes: Episodes, scenes: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.asarray(episodes["speed"])[scenes].mean(axis=1)


def _cost(episodes: Episodes, scenes: NDArray[np.int64]) -> NDArray[np.float64]:
    work, way = (np.asarray(episodes[name])[scenes].sum(axis=1) for name in ("energy", "distance"))
    return np.asarray(work / way)


def _shown(value: float, low: float, high: float) -> str:
    return f"{value:+.1f} [{low:+.1f}, {high:+.1f}]"


if __name__ == "__main__":
    raise SystemExit(main())
