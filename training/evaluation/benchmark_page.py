"""The benchmark's results as JSON, Markdown and pictures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from snake_env._files import write_json, write_text
from snake_env.evaluation import scores, seeds
from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.scores import SCORES, Row
from snake_env.evaluation.statistics import Estimate
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.markdown import table
from snake_env.policies.gaits import GaitParameters
from training.config import ROOT
from training.evaluation import figures, over_all_tasks, reference_limits
from training.runs import versions

DOCS = ROOT / "docs"

SHOWN = ("success", "speed", "cost_of_transport")
"""Scores of the tables; the JSON file has all, with intervals."""

WITH_INTERVAL = ("success",)

MU = 0.2
"""Friction coefficient of the tasks with pegs."""

HEADING = "\n## "
"""Before the name of each task."""

OVER_ALL = "Over all tasks"
"""Heading of the section about the policies that play in every task."""

PICTURE = "learning-over-all-tasks.png"

HEAD = """# Benchmark of learning and control

Printed by `python -m training benchmark`: {episodes} episodes per policy and task on test scenes, the same for all
policies. Brackets are 95 % bootstrap intervals over scenes. The JSON file beside this page has all of them.

Bounds: cost of transport {least:.3f} for any steady planar motion at mu = {mu}, and {weaving:.3f} for any that passes
the pegs of the thesis's course on alternating sides. It is {leader:.3f} for a body that follows the curve of the
thesis's gait without slip. Speed without slip: {thesis:.3f} m/s for that gait, {fastest:.3f} m/s for the fastest wave
that actions can command.
"""


def write(
    played: dict[str, dict[str, Episodes]],
    chosen: list[BenchmarkTask],
    episodes: int,
    out: Path,
    stem: str = "benchmark",
    pictures: str = ".",
    keep: bool = False,
) -> Path:
    """Writes ``<stem>.json``, ``<stem>.md`` and a picture per task; returns the Markdown page.

    With ``keep`` tasks that were not played stay as these files have them, if with as many episodes; so does then the
    section over all tasks.
    """
    (out / pictures).mkdir(parents=True, exist_ok=True)
    page, data = out / f"{stem}.md", out / f"{stem}.json"
    sections, content, aggregates = kept(page, data, episodes) if keep else ({}, {}, {})
    text = HEAD.format(
        episodes=episodes,
        mu=MU,
        least=reference_limits.least_cost(MU),
        weaving=reference_limits.weaving_cost(MU),
        leader=reference_limits.follow_the_leader_cost(MU),
        thesis=reference_limits.no_slip_speed(GaitParameters()),
        fastest=reference_limits.no_slip_speed(reference_limits.FASTEST_WAVE),
    )
    planar = [task.name for task in chosen if task.model == "planar"]  # no policy plays in both models
    if len(planar) > 1 and {task.name for task in chosen} >= set(content):
        overall = over_all_tasks.over_all({name: played[name] for name in planar})
        picture = Path(pictures) / PICTURE
        figures.performance_profiles({name: row.profile for name, row in overall.items()}, out / picture)
        over_all = f"{HEADING}{OVER_ALL}\n\n{over_all_tasks.text(overall, picture.as_posix())}"
        sections = {OVER_ALL: over_all} | {name: one for name, one in sections.items() if name != OVER_ALL}
        aggregates = over_all_tasks.plain(overall)
    for task in chosen:
        rows = {name: scores.score(cell) for name, cell in played[task.name].items()}
        picture = Path(pictures) / f"learning-{task.name}.png"
        figures.benchmark(rows, out / picture)
        sections[task.name] = section(task, rows, played[task.name], picture)
        content[task.name] = {
            "env": task.env_id,
            "options": task.options,
            "scores": {name: scores.plain(row) for name, row in rows.items()},
        }
    write_text(page, text + "".join(sections.values()))
    held_out = f"{seeds.HELD_OUT.start} to {seeds.HELD_OUT.start + episodes - 1}, one per field"
    found = {"episodes": episodes, "seeds": held_out, "versions": versions()}
    write_json(data, {**found, "over_all_tasks": aggregates, "tasks": content})
    return page


def kept(page: Path, data: Path, episodes: int) -> tuple[dict[str, str], dict[str, Any], dict[str, Any]]:
    """Sections, scores by task and aggregates of a page written before, if it has as many episodes."""
    if not page.exists() or not data.exists():
        return {}, {}, {}
    before = json.loads(data.read_text())
    if before["episodes"] != episodes:
        return {}, {}, {}
    sections = page.read_text().split(HEADING)[1:]
    by_heading = {one.partition("\n")[0]: HEADING + one for one in sections}
    return by_heading, before["tasks"], before.get("over_all_tasks", {})


def section(task: BenchmarkTask, rows: dict[str, Row], played: dict[str, Episodes], picture: Path) -> str:
    """A task's table and picture."""
    shown = [one for one in SCORES if one.name in SHOWN]
    heads = ["policy", *(f"{one.name.replace('_', ' ')}{f' [{one.unit}]' if one.unit != '1' else ''}" for one in shown)]
    lines = ([name, *(_cell(one, row[one.name]) for one in shown)] for name, row in rows.items())
    text = f"{HEADING}{task.name}\n\n`{task.env_id}`, {task.about}.\n\n{table(heads, lines)}\n"
    diverged = sum(int(cell["diverged"].sum()) for cell in played.values())
    note = f"\nDiverged episodes: {diverged}.\n" if diverged else ""
    return text + note + f"\n![{task.name}]({picture.as_posix()})\n"


def _cell(one: scores.Score, value: Estimate) -> str:
    text = scores.cell(value, one.decimals)
    return text if one.name in WITH_INTERVAL else text.partition(" [")[0]
