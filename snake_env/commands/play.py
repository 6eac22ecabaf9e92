"""Watch one episode in a window, or film it.

    snake-env play --policy field-hard
    snake-env play --task maze --policy field-hard --scene 3 --film maze.mp4

It is the episode that ``snake-env evaluate`` scores for the same scene: actions do not depend on the batch.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from snake_env.commands.arguments import add_policy, add_task, chosen_task
from snake_env.evaluation import film, seeds
from snake_env.evaluation.acting import BASELINE, acting


def main(arguments: list[str]) -> int:
    """Runs the command."""
    cli = argparse.ArgumentParser(
        "snake-env play", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_task(cli)
    add_policy(cli, default=BASELINE)
    cli.add_argument("--scene", type=int, default=0, metavar="K", help="test scene, from 0")
    cli.add_argument("--film", type=Path, metavar="FILE", help="write a film, .mp4 or .gif, instead")
    args = cli.parse_args(arguments)
    if not 0 <= args.scene < len(seeds.HELD_OUT):
        cli.error(f"argument --scene: {args.scene}: expected an integer in [0, {len(seeds.HELD_OUT)})")
    if args.film is not None:
        args.film = film.file(args.film)
    task = chosen_task(args, args.policy)
    policy = acting(args.policy, task)
    mode = "human" if args.film is None else "rgb_array"
    episode = film.play(policy, task.env_id, seeds.HELD_OUT[args.scene], render_mode=mode, **task.options)
    print(f"{policy.name}, {task.name}, test scene {args.scene}: " + ("goal reached" if episode.success else "failed"))
    if args.film is not None:
        args.film.parent.mkdir(parents=True, exist_ok=True)
        print(film.write(episode.frames, args.film))
    return 0
