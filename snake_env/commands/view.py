"""Watch a running robot in the browser, and change what it does.

    snake-env view --policy general
    snake-env view --task maze --policy heading-control
    snake-env view --policy model.zip

The page has the scene in 3D with forces as arrows, and controls: task, policy or scripted controller, gait, friction,
obstacles to drag, speed, plots. Episodes are on one test scene of the task after another. Without --policy a shipped
policy that fits the task acts.
"""

from __future__ import annotations

from snake_env._cli import parser
from snake_env.commands.arguments import add_policy, add_task


def main(arguments: list[str]) -> int:
    """Serves the page until the process is interrupted."""
    cli = parser("view", __doc__)
    add_task(cli)
    add_policy(cli)
    cli.add_argument("--host", default="127.0.0.1", help="interface that serves the page (default: this machine only)")
    cli.add_argument("--port", type=int, default=8080, help="of the page (default 8080, or the next free one)")
    args = cli.parse_args(arguments)
    if not 1 <= args.port <= 65535:
        cli.error(f"argument --port: {args.port}: expected an integer in [1, 65535]")
    from snake_env.viewer.live import view

    how = {"host": args.host, "port": args.port, "normalize": args.normalize, "trust": args.trust}
    view(args.policy, args.env or args.task, **how, **args.options).wait()
    return 0
