"""Watch a running robot in the browser, and change what it does.

    snake-env view
    snake-env view --task maze --policy field-hard

The page has the scene in 3D with forces as arrows, and controls: task, policy or scripted controller, gait, friction,
obstacles to drag, speed, plots. The scene is the first test scene of the task.
"""

from __future__ import annotations

import argparse

from snake_env.commands.arguments import add_policy, add_task, chosen_task
from snake_env.evaluation.acting import BASELINE


def main(arguments: list[str]) -> int:
    """Serves the page until the process is interrupted."""
    cli = argparse.ArgumentParser(
        "snake-env view", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_task(cli)
    add_policy(cli, default=BASELINE)
    cli.add_argument("--host", default="127.0.0.1", help="interface that serves the page (default: this machine only)")
    cli.add_argument("--port", type=int, default=8080, help="of the page (default 8080, or the next free one)")
    args = cli.parse_args(arguments)
    if not 1 <= args.port <= 65535:
        cli.error(f"argument --port: {args.port}: expected an integer in [1, 65535]")
    task = chosen_task(args, args.policy)
    from snake_env.viewer.live import Live

    page = Live(task, args.policy, args.host, args.port)
    print(f"{page.url}  (Ctrl-C stops)", flush=True)
    page.wait()
    return 0
