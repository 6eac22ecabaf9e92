"""What touch is worth: policies of class aiko with a map, with rays, with touch alone, and with none of these.

    python -m experiments.touch

Success and speed are those of the entries in `submissions/`, with Student's intervals over runs. Then every run plays
held-out hard fields at fine precision: once as it is, for the force of the pegs on each link along the way to the goal,
and once for each group of senses that is hidden from it, by zeros. Prints tables in Markdown and draws the forces.
Measurements are kept in runs/touch: after Ctrl-C the same command continues.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Memory
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy import stats

from snake_env import drawing
from snake_env.evaluation import seeds
from snake_env.evaluation.rollout import make_env, play
from snake_env.evaluation.statistics import student_interval
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.markdown import table
from snake_env.policies.interface import Policy, acting
from snake_env.policies.loading import load_policy
from training.cli import answer
from training.config import Count
from training.evaluation import cached_scores
from training.submission import leaderboard
from training.submission.entry import Submission, policy, read
from training.submission.play import task_of

TRACKS = ("map", "range", "touch", "proprioception")
HIDDEN: dict[str, dict[str, tuple[str, ...]]] = {
    "map": {"pegs": ("pegs", "link_pegs"), "forces": ("contact_force",)},
    "range": {"rays": ("range",), "forces": ("contact_force",)},
    "touch": {"forces": ("contact_force",)},
}
"""Blocks that are hidden from the policies of a track, by what they tell."""
TASK = "field-hard"
PUSH = 1.0
"""A link that is pushed ahead by at least this is at a push-point [N]."""

CACHE = Path("runs/touch")

Array = NDArray[np.float64]


@dataclass
class Options:
    """What is measured.

    Args:
        scenes: Held-out hard fields of each run.
        num_threads: Threads of the simulator.
        picture: PNG file.
    """

    scenes: Count = 100
    num_threads: int | None = None
    picture: Path = Path("runs/touch.png")


@dataclass
class Mechanism:
    """Of a run, means over the steps of all episodes.

    Args:
        success: Share of the episodes.
        ahead: Force on each link towards the goal, where it pushes (links,) [N].
        back: The same where it brakes, negative (links,) [N].
        push_points: Share of the time with 0, 1, ... links pushed ahead.
    """

    success: float
    ahead: Array
    back: Array
    push_points: Array


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


def compare(args: Options) -> int:
    """Prints the tables and draws."""
    entries = {track: read(folder(track)) for track in TRACKS}
    print(scores(entries))
    print("\n".join(f"* {line}" for line in differences(entries)))
    found = {track: [measure(one, args.scenes, args.num_threads) for one in files(track)] for track in TRACKS}
    print(hiding(found, args))
    args.picture.parent.mkdir(parents=True, exist_ok=True)
    print(draw(entries, found, args.picture))
    return 0


def folder(track: str) -> Path:
    """Of the entry of a track."""
    return leaderboard.FOLDER / f"aiko-{track}"


def files(track: str) -> list[str]:
    """The policies of the entry of a track."""
    return [policy(folder(track), run) for run in read(folder(track)).runs]


def scores(entries: dict[str, Submission]) -> str:
    """Success in each task, and speed and contact-free progress in hard fields, by track."""
    tasks = entries["map"].tasks
    rows = []
    for track, entry in entries.items():
        cells = [_interval(leaderboard.values(entry, task, "success")) for task in tasks]
        speed = _interval(leaderboard.values(entry, TASK, "speed"), np.inf)
        free = _interval(leaderboard.values(entry, TASK, "contact_free"))
        rows.append([track, str(len(entry.runs)), *cells, speed, free])
    return table(["track", "runs", *tasks, "speed [m/s]", "contact-free"], rows)


def _interval(values: Sequence[float], most: float = 1.0) -> str:
    found = student_interval(values, least=0.0, most=most)
    return f"{found.value:.3f} [{found.low:.3f}, {found.high:.3f}]" if len(values) > 1 else f"{found.value:.3f}"


def differences(entries: dict[str, Submission]) -> list[str]:
    """In success between neighbouring tracks, task by task, with Welch's intervals over runs."""
    lines = []
    for more, less in pairwise(TRACKS):
        parts = []
        for task in entries[more].tasks:
            ours, theirs = (leaderboard.values(entries[one], task, "success") for one in (more, less))
            parts.append(f"{task} {np.mean(ours) - np.mean(theirs):+.3f}")
            if min(len(ours), len(theirs)) > 1:  # one run tells nothing about others
                ends = stats.ttest_ind(ours, theirs, equal_var=False).confidence_interval()
                parts[-1] += f" [{ends.low:+.3f}, {ends.high:+.3f}]"
        lines.append(f"{more} against {less}: " + ", ".join(parts))
    return lines


def measure(file: str, scenes: int, num_threads: int | None, hidden: Sequence[str] = ()) -> Mechanism:
    """Plays a policy in hard fields, with some blocks of its observation at zero, unless it has been played before."""
    cached = Memory(CACHE, verbose=0).cache(_play, ignore=["file", "num_threads"])
    found: Mechanism = cached(file, scenes, num_threads, tuple(hidden), _content(file), cached_scores.code())
    return found


def _content(file: str) -> bytes:
    path = Path(file)
    return path.read_bytes() if path.is_file() else file.encode()


def _play(
    file: str, scenes: int, num_threads: int | None, hidden: tuple[str, ...], content: bytes, code: str
) -> Mechanism:
    """``content`` and ``code`` are keys of the cache only."""
    task: BenchmarkTask = task_of(TASK, "aiko")
    player: Policy = load_policy(file)
    env = make_env(task.env_id, scenes, num_threads, **acting(player, task.options))
    layout: dict[str, Any] = env.unwrapped.layout
    player.begin(layout, scenes)
    blocks = [block for block in layout["observation"] if block["name"] in hidden]
    unseen = [k for block in blocks for k in range(block["start"], block["start"] + block["size"])]
    pushed: list[Array] = []

    def act(observation: NDArray[np.float32]) -> NDArray[np.float32]:
        pushed.append(env.unwrapped.state().contact_force[..., 0])  # the goal lies along x
        shown = observation.copy()
        shown[:, unseen] = 0.0
        return player(shown)

    episodes, _ = play(env, act, seeds.held_out(scenes))
    env.close()
    steps = np.round(episodes["time"] / float(layout["control_period"]))
    force = np.array(pushed)[np.arange(len(pushed))[:, None] < steps]
    points = (force >= PUSH).sum(axis=1)
    return Mechanism(
        success=float(episodes["is_success"].mean()),
        ahead=np.maximum(force, 0.0).mean(axis=0),
        back=np.minimum(force, 0.0).mean(axis=0),
        push_points=np.bincount(points, minlength=force.shape[1] + 1) / len(points),
    )


def hiding(found: dict[str, list[Mechanism]], args: Options) -> str:
    """Success in hard fields with all senses, and with some of them hidden."""
    rows = []
    for track in TRACKS:
        rows.append([track, "nothing", _interval([one.success for one in found[track]])])
        for what, blocks in HIDDEN.get(track, {}).items():
            without = [measure(one, args.scenes, args.num_threads, blocks).success for one in files(track)]
            rows.append([track, what, _interval(without)])
    return table(["track", "hidden", f"success on {args.scenes} scenes"], rows)


def draw(entries: dict[str, Submission], found: dict[str, list[Mechanism]], path: Path) -> Path:
    """Success by task, forces by link, and the share of the time with so many push-points; a mark or line per run."""
    with drawing.style():
        drawn, axes = drawing.figure(1, 3, 9.0, 2.9)
        for number, track in enumerate(TRACKS):
            runs = found[track]
            _successes(axes[0, 0], entries[track], number)
            for sign, forces in ((1, [one.ahead for one in runs]), (-1, [one.back for one in runs])):
                label = track if sign > 0 else None
                _lines(axes[0, 1], np.linspace(1, len(forces[0]), len(forces[0])), forces, number, label)
            _lines(axes[0, 2], np.linspace(0, 5, 6), [one.push_points[:6] for one in runs], number, track)
        tasks = entries["map"].tasks
        axes[0, 0].set(xticks=range(len(tasks)), xticklabels=tasks, ylabel="success", ylim=(0.0, 1.05))
        axes[0, 1].axhline(0.0, color="black", linewidth=0.6)
        axes[0, 1].set(xlabel="link, from the head", ylabel="mean force along the way [N]", xticks=range(1, 12, 2))
        axes[0, 1].set_title("above: pushed ahead; below: braked", fontsize=8)
        axes[0, 2].set(xlabel="push-points at a time", ylabel="share of the time", ylim=(0.0, None))
        axes[0, 2].legend(fontsize=7)
        return drawing.save(drawn, path)


def _successes(axes: Axes, entry: Submission, number: int) -> None:
    """A mark per run and task, and a line at their mean."""
    for place, task in enumerate(entry.tasks):
        x, rates = place + 0.2 * (number - 0.5 * (len(TRACKS) - 1)), leaderboard.values(entry, task, "success")
        axes.plot(np.full(len(rates), x), rates, "o", color=f"C{number}", markersize=3.5)
        axes.hlines(np.mean(rates), x - 0.09, x + 0.09, color=f"C{number}", linewidth=2.0)


def _lines(axes: Axes, x: Array, runs: Sequence[Array], number: int, label: str | None) -> None:
    """A thin line per run, and one for their mean."""
    for one in runs:
        axes.plot(x, one, color=f"C{number}", linewidth=0.5, alpha=0.6)
    axes.plot(x, np.mean(runs, axis=0), color=f"C{number}", linewidth=1.6, label=label)


if __name__ == "__main__":
    sys.exit(main())
