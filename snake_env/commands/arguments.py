"""What several commands ask for: a task and who acts in it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from snake_env import _documents
from snake_env.evaluation import tasks
from snake_env.evaluation.tasks import BenchmarkTask, acting_in
from snake_env.policies.interface import Policy
from snake_env.policies.loading import CHOICES, GAIT
from snake_env.registration import TASKS


def add_task(cli: argparse.ArgumentParser) -> None:
    """Adds --task, --env and --options."""
    cli.add_argument("--task", metavar="NAME", help=f"one of {', '.join(tasks.load())}")
    cli.add_argument("--env", metavar="ID", help=f"an environment instead: {', '.join(TASKS)}")
    cli.add_argument("--options", type=_object, default={}, metavar="JSON", help="keywords of the environment")


def add_policy(cli: argparse.ArgumentParser, **more: Any) -> None:
    """Adds --policy, --normalize and --trust."""
    cli.add_argument("--policy", metavar="NAME", help=f"{CHOICES}; by default the gait of action zero", **more)
    cli.add_argument(
        "--normalize", type=Path, metavar="FILE", help="of VecNormalize; default: vecnormalize.pkl beside a zip"
    )
    cli.add_argument("--trust", action="store_true", help="the policy's file may run code")


def acting(
    args: argparse.Namespace, policy: str | None, task: BenchmarkTask | None = None
) -> tuple[Policy, BenchmarkTask]:
    """Who acts, and where: in the task given, else where the policy was trained, else in fields of medium difficulty.

    Raises:
        ConfigError: there is no such policy or task, or they do not fit each other.
    """
    is_file = policy is not None and Path(policy).is_file()
    how = {"normalize": args.normalize, "trust": args.trust}
    found, where = acting_in(policy or GAIT, task or args.env or args.task, options=args.options, **how)
    about = getattr(getattr(found, "card", None), "about", "")
    if about and is_file:
        print(f"{found.name}: {about}")
    return found, where


def _object(text: str) -> dict[str, Any]:
    try:
        found = _documents.of_json(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"expected a JSON object ({error})") from None
    if not isinstance(found, dict):
        raise argparse.ArgumentTypeError(f"expected a JSON object, found {text}")
    return found
