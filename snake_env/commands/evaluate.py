"""Score policies on test scenes, on none of which anything was trained or tuned.

    snake-env evaluate --policy field-hard
    snake-env evaluate --policy model.zip --normalize vecnormalize.pkl --out scores.tex
    snake-env evaluate --task maze --policy field-hard --policy heading-control --policy gait

Every policy meets the same scenes. Prints success, progress, speed, time to the goal, share of time spent jammed, cost
of transport and share of robots that left the corridor, each with its 95 % bootstrap interval over scenes.
"""

from __future__ import annotations

import json
from pathlib import Path

from snake_env import robot_classes
from snake_env._cli import parser
from snake_env._files import write_json, write_text
from snake_env.commands.arguments import acting, add_policy, add_task
from snake_env.evaluation import scores, tasks, tracks
from snake_env.evaluation.protocol import evaluate
from snake_env.policies.loading import GAIT

EPISODES = 200


def main(arguments: list[str]) -> int:
    """Runs the command."""
    cli = parser("evaluate", __doc__)
    add_task(cli)
    add_policy(cli, action="append")
    cli.add_argument("--episodes", "--scenes", type=int, default=EPISODES, help=f"test scenes (default {EPISODES})")
    cli.add_argument("--seed", type=int, default=0, help="number of the first test scene (default 0)")
    cli.add_argument("--class", dest="robot_class", metavar="NAME", help=f"of robot: {', '.join(robot_classes.load())}")
    cli.add_argument("--track", metavar="NAME", help=f"what policies may observe: {', '.join(tracks.load())}")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, metavar="FILE", help="also write the scores: .tex for LaTeX, else JSON")
    args = cli.parse_args(arguments)
    if args.episodes < 1:
        cli.error(f"argument --episodes: {args.episodes}: expected an integer >= 1")
    named = args.policy or [GAIT]
    if args.normalize is not None and len(named) > 1:
        cli.error("argument --normalize: expected one --policy, to which the file belongs")
    first, task = acting(args, named[0])
    policies = [first, *(acting(args, name, task)[0] for name in named[1:])]
    task = tasks.judged(task, args.robot_class)
    print(f"{task.env_id} {json.dumps(task.options)}, {args.episodes} test scenes")
    how = {name: getattr(args, name) for name in ("episodes", "seed", "num_threads", "track")}
    found = [evaluate(policy, task, **how) for policy in policies]
    names = [one.name for one in found]
    rows = {text if names.count(one.name) > 1 else one.name: one.scores for text, one in zip(named, found, strict=True)}
    print(scores.table(rows))
    if args.out is not None:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        if args.out.suffix == ".tex":
            write_text(args.out, scores.latex(rows))
            return 0
        plain = {name: scores.plain(row) for name, row in rows.items()}
        content = {"env": task.env_id, "options": task.options, "scenes": args.episodes, "scores": plain}
        write_json(args.out, content)
    return 0
