"""Watch one episode in a window, or film it.

    snake-env play --policy field-hard
    snake-env play --task maze --policy field-hard --seed 3 --film maze.mp4
    snake-env film maze.mp4 --task maze --policy field-hard --seed 3

It is the episode that ``snake-env evaluate`` scores for the same scene: actions do not depend on the batch.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from snake_env._cli import parser
from snake_env.commands.arguments import acting, add_policy, add_task
from snake_env.evaluation import film as films
from snake_env.evaluation import seeds


def main(arguments: list[str]) -> int:
    """Runs ``snake-env play``."""
    cli = parser("play", __doc__)
    cli.add_argument("--film", type=Path, metavar="FILE", help="write a film, .mp4 or .gif, instead")
    return _play(cli, arguments)


def film(arguments: list[str]) -> int:
    """Runs ``snake-env film``."""
    cli = parser("film", __doc__)
    cli.add_argument("film", type=Path, metavar="FILE", help="film to write, .mp4 or .gif")
    return _play(cli, arguments)


def _play(cli: argparse.ArgumentParser, arguments: list[str]) -> int:
    add_task(cli)
    add_policy(cli)
    cli.add_argument("--seed", "--scene", type=int, default=0, metavar="K", help="test scene, from 0")
    args = cli.parse_args(arguments)
    if not 0 <= args.seed < len(seeds.HELD_OUT):
        cli.error(f"argument --seed: {args.seed}: expected an integer in [0, {len(seeds.HELD_OUT)})")
    if args.film is not None:
        args.film = films.file(args.film)
    policy, task = acting(args, args.policy)
    mode = "human" if args.film is None else "rgb_array"
    episode = films.play(policy, task.env_id, seeds.HELD_OUT[args.seed], render_mode=mode, **task.options)
    print(f"{policy.name}, {task.name}, test scene {args.seed}: " + ("goal reached" if episode.success else "failed"))
    if args.film is not None:
        args.film.parent.mkdir(parents=True, exist_ok=True)
        print(films.write(episode.frames, args.film))
    return 0
