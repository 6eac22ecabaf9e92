"""Score policies and scripted gaits on held-out fields.

    python -m training evaluate --policy runs/field/policy.safetensors --film
    python -m training evaluate --gait thesis --gait 30,120,-50 --env SnakeFree-v1

Without --env the task is the one that the first policy was trained in. All policies play on the same fields, on none of
which anything was trained. Prints success, progress, speed, time to the goal, share of jammed time, cost of transport
and share of robots that left the corridor, each with its 95 % bootstrap interval over fields, and writes them as JSON.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from snake_env.evaluation import scores, seeds
from snake_env.evaluation.rollout import run_episodes
from snake_env.policies.gaits import GaitPolicy
from snake_env.policies.interface import Policy, refuse_other_interface
from training.cli import Gait, answer
from training.config import Count, JsonObject
from training.evaluation import loading
from training.evaluation.report import FIELDS, film, report


@dataclass
class Options:
    """What is scored, and where.

    Args:
        policy: policy.safetensors or model.zip of a run; may be repeated.
        gait: 'thesis', or A,omega,beta in degrees and degrees per second; may be repeated. If none is given, that of
            action zero.
        env: Environment; by default that of the first policy, or SnakeField-v1.
        options: Keywords of the environment.
        fields: Number of held-out fields.
        num_threads: Threads of the simulator.
        out: Folder for JSON and video.
        film: Film the last policy on the first field that it passes.
    """

    policy: Annotated[tuple[Path, ...], tyro.conf.UseAppendAction, tyro.conf.arg(aliases=["--model"])] = ()
    gait: tyro.conf.UseAppendAction[tuple[Gait, ...]] = ()
    env: str | None = None
    options: JsonObject = field(default_factory=dict)
    fields: Count = FIELDS
    num_threads: int | None = None
    out: Path = Path("runs/evaluate")
    film: Annotated[bool, tyro.conf.arg(aliases=["--video"])] = False


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, evaluate, __doc__, arguments)


def evaluate(given: Options) -> int:
    """Plays all policies, prints and writes their scores."""
    paths = list(given.policy)
    env_id, options = loading.task(given.env, given.options, paths)
    policies: list[Policy] = [GaitPolicy(gait) for gait in given.gait] or [GaitPolicy()]
    policies += loading.load_models(paths)
    loading.refuse_other_model(paths, env_id, options)
    for policy in policies:
        refuse_other_interface(policy, options)
    print(f"{env_id} {json.dumps(options)}, {given.fields} held-out fields")
    fields = seeds.held_out(given.fields)
    played = {}
    for one in policies:
        episodes = run_episodes(one, env_id, fields, given.num_threads, **options)
        played[one.name] = episodes  # that of the default gait is known only now
    rows = {name: scores.score(episodes) for name, episodes in played.items()}
    report(rows, played, given.out, {"env": env_id, "options": options, "fields": given.fields})
    if given.film:
        print(film(policies[-1], env_id, played[policies[-1].name], given.out / "episode", options))
    return 0


if __name__ == "__main__":
    sys.exit(main())
