"""Scores of the shipped policies on test scenes of the task that each was trained in, for their cards.

    python -m experiments.policy_cards            # print
    python -m experiments.policy_cards --write    # also write snake_env/policies/shipped/*.json

What else a card says is kept: environment and steps are in the metadata of the policy's file; training, licence,
notes, and what the scores have on top of the environment are in the JSON file, written by hand.
"""

from __future__ import annotations

import argparse
from importlib.metadata import version
from typing import Any

import snake_env
from snake_env._files import write_json
from snake_env.evaluation import rollout, scores, seeds
from snake_env.policies.loading import load_policy
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.shipped import FOLDER, NAMES

SCENES = 500


def card(name: str, scenes: int = SCENES) -> dict[str, Any]:
    """What the JSON file beside a shipped policy holds."""
    policy = load_policy(name)
    known: PolicyCard = policy.card
    episodes = rollout.run_episodes(policy, str(known.env_id), seeds.held_out(scenes), **known.scored_options)
    found = scores.plain(scores.score(episodes))
    return {
        "training": known.training,
        "license": known.license,
        "scored_in": known.scored_in,
        "scenes": scenes,
        "scores": {key: list(value.values()) for key, value in found.items()},
        "versions": {"snake_env": snake_env.__version__, "numpy": version("numpy"), "gymnasium": version("gymnasium")},
        "notes": list(known.notes),
    }


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--write", action="store_true", help="write the files")
    cli.add_argument("--scenes", type=int, default=SCENES, help="test scenes")
    cli.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, help="policies; default: all")
    args = cli.parse_args(arguments)
    for name in args.only:
        found = card(name, args.scenes)
        if args.write:
            write_json(FOLDER / f"{name}.json", found)
        value, low, high = found["scores"]["success"]
        print(f"{name}: success {value:.3f} [{low:.3f}, {high:.3f}], speed {found['scores']['speed'][0]:.3f} m/s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
