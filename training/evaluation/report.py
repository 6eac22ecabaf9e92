"""What an evaluation leaves: a printed table, JSON, a film."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from snake_env._files import write_json
from snake_env.evaluation import film as films
from snake_env.evaluation import scores, seeds
from snake_env.evaluation.rollout import Episodes
from snake_env.policies.interface import Policy
from training.runs import versions

FIELDS = 200
"""Held-out fields of a report."""


def report(rows: dict[str, scores.Row], played: dict[str, Episodes], out: Path, what: dict[str, Any]) -> None:
    """Prints the table and writes ``evaluation.json``; differences are to the first policy."""
    print(scores.table(rows))
    first, *others = rows
    differences = {name: scores.against(played[name], played[first]) for name in others}
    for name, difference in differences.items():
        print(scores.difference_text(name, first, difference))
    out.mkdir(parents=True, exist_ok=True)
    content = {
        **what,
        "seeds": f"{seeds.HELD_OUT.start} and on, one per field",
        "versions": versions(),
        "scores": {name: scores.plain(row) for name, row in rows.items()},
        f"against {first}": {name: scores.plain(row) for name, row in differences.items()},
    }
    write_json(out / "evaluation.json", content)


def film(policy: Policy, env_id: str, episodes: Episodes, path: Path, options: dict[str, Any]) -> Path:
    """A video of the first field that the policy passes, or of the first of all."""
    passed = episodes["is_success"].nonzero()[0]
    seed = seeds.HELD_OUT[int(passed[0]) if len(passed) else 0]
    return films.write(films.play(policy, env_id, seed, render_mode="rgb_array", **options).frames, path)
