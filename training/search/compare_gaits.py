"""Search for the best constant gait and compare it with the thesis's under the same torque limit.

    python -m training gaits
    python -m training gaits --env SnakeCourse-v1 --amplitude 30 50 --omega 80 120 --beta -60 -50
    python -m training gaits --env SnakeSpatial-v1 --batches 12   # both waves

The search plays on validation fields; the best gait and the thesis's are then scored on held-out fields. Writes a
figure and JSON.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from snake_env.evaluation import scores, seeds
from snake_env.evaluation.rollout import layout_of, run_episodes
from snake_env.policies.gaits import GaitParameters, GaitPolicy
from training.config import Count, JsonObject
from training.evaluation.report import FIELDS, report
from training.search.gait_search import PLAN, RANGES, gait, ranges_of, search, write
from training.search.optimise import Range


@dataclass
class Options:
    """Environment and ranges of the search.

    Args:
        env: Environment.
        options: Keywords of the environment.
        search_options: Keywords of the environment in the search only, on top of ``options``.
        amplitude: Range of A [deg].
        omega: Range of omega [deg/s].
        beta: Range of beta [deg].
        fields: Held-out fields of the comparison.
        batches: Batches of candidates.
        quick: A tenth of the candidates and fields.
        num_threads: Threads of the simulator.
        out: Output folder.
    """

    env: str = "SnakeField-v1"
    options: JsonObject = field(default_factory=dict)
    search_options: JsonObject = field(default_factory=dict)
    amplitude: Range | None = None
    omega: Range | None = None
    beta: Range | None = None
    fields: Count = FIELDS
    batches: Count = PLAN.batches
    quick: bool = False
    num_threads: int | None = None
    out: Path = Path("runs/gaits")


def compare(args: Options) -> int:
    """Searches, then scores the best gait and the thesis's."""
    given = {name: bounds for name in RANGES if (bounds := getattr(args, name)) is not None}
    options = args.options | args.search_options
    ranges = {**ranges_of(layout_of(args.env, options | {"action_mode": "gait"})["action"]), **given}
    plan = PLAN.quick() if args.quick else replace(PLAN, batches=args.batches)
    found = search(args.env, ranges, plan, args.num_threads, show=True, **options)
    write(found, args.out)
    best = gait(found.best)
    print(f"best of {len(found.tried)} gaits: {best}")
    policies = [GaitPolicy(one) for one in (GaitParameters(), best)]
    fields = seeds.held_out(args.fields)
    played = {one.name: run_episodes(one, args.env, fields, args.num_threads, **args.options) for one in policies}
    rows = {name: scores.score(episodes) for name, episodes in played.items()}
    report(rows, played, args.out, {"env": args.env, "options": args.options, "fields": args.fields})
    return 0
