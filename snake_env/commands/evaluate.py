"""Score policies on test scenes, on none of which anything was trained or tuned.

    snake-env evaluate --policy field-hard
    snake-env evaluate --task maze --policy field-hard --policy "heading control" --policy gait

Every policy meets the same scenes. Prints success, progress, speed, time to the goal, share of time spent jammed, cost
of transport and share of robots that left the corridor, each with its 95 % bootstrap interval over scenes.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from snake_env._files import write_json
from snake_env.commands.arguments import add_policy, add_task, chosen_task
from snake_env.evaluation import scores
from snake_env.evaluation.acting import BASELINE, acting
from snake_env.evaluation.protocol import evaluate

SCENES = 200


def main(arguments: list[str]) -> int:
    """Runs the command."""
    cli = argparse.ArgumentParser(
        "snake-env evaluate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_task(cli)
    add_policy(cli, action="append")
    cli.add_argument("--scenes", type=int, default=SCENES, help=f"number of test scenes (default {SCENES})")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, metavar="FILE", help="also write the scores as JSON")
    args = cli.parse_args(arguments)
    if args.scenes < 1:
        cli.error(f"argument --scenes: {args.scenes}: expected an integer >= 1")
    named = args.policy or [BASELINE]
    task = chosen_task(args, named[0])
    print(f"{task.env_id} {json.dumps(task.options)}, {args.scenes} test scenes")
    rows = {}
    for policy in [acting(name, task) for name in named]:
        rows[policy.name] = evaluate(policy, task, scenes=args.scenes, num_threads=args.num_threads).scores
    print(scores.table(rows))
    if args.out is not None:
        plain = {name: scores.plain(row) for name, row in rows.items()}
        content = {"env": task.env_id, "options": task.options, "scenes": args.scenes, "scores": plain}
        args.out.parent.mkdir(parents=True, exist_ok=True)
        write_json(args.out, content)
    return 0
