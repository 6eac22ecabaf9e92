"""Replay an entry of the benchmark on other test scenes, and say whether its scores hold.

    python -m training verify submissions/mine

Every policy plays in every task on scenes that its scores are not from. Success is compared by Fisher's exact test,
speed by Welch's. A score does not hold where chance would make such a difference in less than one of a hundred
verifications of the whole entry. Exit status 1 where one does not hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro
from scipy import stats

from snake_env.markdown import table
from training.config import Count
from training.submission import play
from training.submission.entry import Scores, policy, read

LEVEL = 0.01
"""Probability that an entry whose scores hold is found not to."""


@dataclass
class Options:
    """The replay.

    Args:
        folder: Of the entry.
        episodes: Test scenes of each run in each task.
        first_scene: Number of the first; by default that after those of the scores.
        tasks: Some of the entry's; by default all.
        num_threads: Threads of the simulator.
    """

    folder: tyro.conf.Positional[Path]
    episodes: Count = 200
    first_scene: int | None = None
    tasks: tuple[str, ...] | None = None
    num_threads: int | None = None


def verify(args: Options) -> int:
    """Plays, prints a table; 1 if a score does not hold."""
    entry = read(args.folder)
    first = entry.first_scene + entry.episodes if args.first_scene is None else args.first_scene
    chosen = [play.task_of(name, entry.robot_class) for name in args.tasks or entry.tasks]
    level = LEVEL / (2 * len(entry.runs) * len(chosen))  # Bonferroni
    rows, failed = [], 0
    for run in entry.runs:
        for task in chosen:
            acting = policy(args.folder, run)
            episodes = play.episodes(acting, entry, task, args.episodes, first, args.num_threads)
            before, now = run.scores[task.name], play.summary(episodes)
            holds = min(chances(before, entry.episodes, now, args.episodes)) >= level
            failed += not holds
            pairs = (f"{before.success:.3f}", f"{now.success:.3f}", f"{before.speed:.3f}", f"{now.speed:.3f}")
            rows.append((run.policy, task.name, *pairs, "yes" if holds else "no"))
    heads = ("policy", "task", "success", "replayed", "speed [m/s]", "replayed", "holds")
    print(table(heads, rows))
    print(f"{args.folder}: {'the scores hold' if not failed else f'{failed} of {len(rows)} do not hold'}")
    return 1 if failed else 0


def chances(before: Scores, many: int, now: Scores, few: int) -> tuple[float, float]:
    """Probability of differences in success and speed at least as large as these, if there are none in truth."""
    passed = [round(one.success * count) for one, count in ((before, many), (now, few))]
    success = stats.fisher_exact([[passed[0], many - passed[0]], [passed[1], few - passed[1]]]).pvalue
    if before.speed_deviation == now.speed_deviation == 0.0:  # of one episode, or equal ones
        return float(success), float(min(many, few) < 2 or before.speed == now.speed)
    speed = stats.ttest_ind_from_stats(
        *(before.speed, before.speed_deviation, many),
        *(now.speed, now.speed_deviation, few),
        equal_var=False,
    ).pvalue
    return float(success), float(speed)
