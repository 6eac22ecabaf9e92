"""The leaderboard: a table of every class of robot from the entries in the folder submissions.

python -m training leaderboard            # print
python -m training leaderboard --write    # also write docs/leaderboard.md
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snake_env import robot_classes
from snake_env._files import write_text
from snake_env.evaluation import tasks
from snake_env.evaluation.statistics import Estimate, interquartile_mean, student_interval
from snake_env.markdown import table
from snake_env.policies.gaits import GaitParameters
from training.config import ROOT
from training.evaluation import reference_limits
from training.submission.entry import NAME, Submission, read

FOLDER = ROOT / "submissions"
PAGE = ROOT / "docs/leaderboard.md"

MU = 0.2
"""Friction coefficient of the tasks with pegs."""

MOVEMENT = {"contact_free": "contact-free", "chatter": "chatter"}
"""Scores of how robots move, and their headings."""

HEAD = """# Leaderboard

    python -m training submit --out submissions/mine --policy runs/sweep/mine/seed-0 --policy runs/sweep/mine/seed-1
    python -m training verify submissions/mine
    python -m training leaderboard --write   # this page

[Classes of robot](protocol.md#classes-of-robot) have tables of their own; the [track](protocol.md#tracks) of an entry
admits what its policies observe. *Runs* are trainings with different seeds; *steps* are the environment steps of one
of them and of all that it builds on, in millions. The *score* of an episode is its speed if it reaches the goal, else
zero; that of an entry is the interquartile mean over its runs and all tasks of the table, with a bootstrap interval.
Success rates follow, means over runs with Student's interval. Brackets hold 95 %; one run has none. *Contact-free* is
the share of all progress made while nothing pushed, *chatter* the share of the power of the actions above 4 Hz, both
means over runs and tasks; older entries lack them. Speeds and costs are in `entry.json`.

Bounds: cost of transport {mu:.3f} for any steady planar motion at mu = {mu}, and {weaving:.3f} for any that passes
the pegs of the thesis's course on alternating sides. It is {leader:.3f} for a body that follows the curve of the
thesis's gait without slip. Speed without slip: {thesis:.3f} m/s for that gait, {fastest:.3f} m/s for the fastest wave
that actions can command.
"""


@dataclass
class Options:
    """What is done.

    Args:
        folder: Of the entries.
        write: Write docs/leaderboard.md.
    """

    folder: Path = FOLDER
    write: bool = False


def show(args: Options) -> int:
    """Prints or writes the page."""
    text = page(entries(args.folder))
    if args.write:
        write_text(PAGE, text)
    else:
        print(text)
    return 0


def entries(folder: Path) -> dict[str, Submission]:
    """All entries of a folder, by name.

    Raises:
        ConfigError: one is not admissible.
    """
    return {path.parent.name: read(path.parent) for path in sorted(folder.glob(f"*/{NAME}"))}


def page(found: dict[str, Submission]) -> str:
    """The page as Markdown."""
    # The least cost is mu: isotropic friction takes mu m g |v| of each link, the means of |v| over links and time are
    # no less than the speed made, and only actuators supply energy. Pegs without friction give and take none. The CGs
    # of links that weave, at least half a body's width from every peg, travel farther than the robot makes.
    parts = [
        HEAD.format(
            mu=MU,
            weaving=MU * reference_limits.weaving(),
            leader=reference_limits.follow_the_leader_cost(MU),
            thesis=reference_limits.no_slip_speed(GaitParameters()),
            fastest=reference_limits.no_slip_speed(reference_limits.FASTEST_WAVE),
        )
    ]
    for robot_class in robot_classes.load():
        for suite, known in suites().items():
            group = {
                name.removeprefix(f"{robot_class}-"): one
                for name, one in found.items()
                if one.robot_class == robot_class and set(one.tasks) & set(known)
            }
            if group:
                parts.append(f"## {robot_class}, {suite}\n\n{of_class(group, known)}\n")
    return "\n".join(parts)


def suites() -> dict[str, list[str]]:
    """Names of the tasks of each suite: those of a robot's model unless the task names another."""
    found: dict[str, list[str]] = {}
    for name, task in tasks.load().items():
        found.setdefault(task.suite or task.model, []).append(name)
    return found


def of_class(group: dict[str, Submission], known: list[str]) -> str:
    """The table of a class in a suite, whose tasks are ``known``; the best entry first."""
    columns = [name for name in known if any(name in one.tasks for one in group.values())]
    rows = []
    for name, one in group.items():
        whole = set(columns) <= set(one.tasks)
        score = interquartile_mean(*(values(one, task, "score") for task in columns)) if whole else None
        steps = [run.steps for run in one.runs]
        shown = "-" if None in steps else f"{max(step or 0 for step in steps) / 1e6:.1f}"
        cells = [
            over_runs(student_interval(values(one, task, "success"), 0.0, 1.0), one) if task in one.tasks else "-"
            for task in columns
        ]
        cells += [mean_over_tasks(one, columns, key) for key in MOVEMENT]
        head = (f"`{name}`", one.track, len(one.runs), one.episodes, shown)
        rows.append((score, (*head, over_runs(score, one) if score else "-", *cells)))
    rows.sort(key=lambda row: -row[0].value if row[0] else 0.0)
    heads = ["entry", "track", "runs", "scenes", "steps", "score [m/s]", *columns, *MOVEMENT.values()]
    texts = [[str(cell) for cell in row] for _, row in rows]
    if all(cell == "-" for row in texts for cell in row[-len(MOVEMENT) :]):
        heads, texts = heads[: -len(MOVEMENT)], [row[: -len(MOVEMENT)] for row in texts]
    return table(heads, texts)


def values(entry: Submission, task: str, key: str) -> list[float]:
    """A score of each run in a task."""
    return [float(getattr(run.scores[task], key)) for run in entry.runs]


def mean_over_tasks(entry: Submission, columns: list[str], key: str) -> str:
    """Of a score of all runs in those tasks in which all runs have it."""
    found = [getattr(run.scores[task], key) for task in columns if task in entry.tasks for run in entry.runs]
    return f"{np.mean(found):.3f}" if found and None not in found else "-"


def over_runs(estimate: Estimate, entry: Submission) -> str:
    """A value with its interval over runs, where there are several."""
    interval = f" [{estimate.low:.3f}, {estimate.high:.3f}]" if len(entry.runs) > 1 else ""
    return f"{estimate.value:.3f}{interval}"
