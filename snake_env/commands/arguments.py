"""What several commands ask for: a task and who acts in it."""

from __future__ import annotations

import argparse
from typing import Any

from snake_env import _documents
from snake_env.evaluation import tasks
from snake_env.evaluation.acting import CHOICES
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.shipped import NAMES, load_policy


def add_task(cli: argparse.ArgumentParser) -> None:
    """Adds --task, --env and --options."""
    cli.add_argument("--task", metavar="NAME", help=f"one of {', '.join(tasks.load())}")
    cli.add_argument("--env", metavar="ID", help="an environment instead, such as SnakeField-v1")
    cli.add_argument("--options", type=_object, default={}, metavar="JSON", help="keywords of the environment")


def add_policy(cli: argparse.ArgumentParser, **more: Any) -> None:
    """Adds --policy."""
    cli.add_argument("--policy", metavar="NAME", help=f"{CHOICES}; by default the gait of action zero", **more)


def chosen_task(args: argparse.Namespace, policy: str | None) -> BenchmarkTask:
    """The task given; without one that of the policy's scores, else random fields of medium difficulty.

    Raises:
        ConfigError: there is no such task.
    """
    if args.env is not None:
        return BenchmarkTask(args.env, args.env, args.options, "")
    if args.task is None and policy in NAMES:
        card = load_policy(policy).card
        return BenchmarkTask(policy, card.env_id, card.scored_options | args.options, card.about)
    (found,) = tasks.chosen([args.task or "field-medium"])
    return BenchmarkTask(found.name, found.env_id, found.options | args.options, found.about)


def _object(text: str) -> dict[str, Any]:
    try:
        found = _documents.of_json(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"expected a JSON object ({error})") from None
    if not isinstance(found, dict):
        raise argparse.ArgumentTypeError(f"expected a JSON object, found {text}")
    return found
