"""Scores of the shipped policies on test scenes of the task that each was trained in, for their cards.

    python -m experiments.policy_cards            # print
    python -m experiments.policy_cards --write    # also write snake_env/policies/shipped/*.json

What else a card says, such as the environment, is in the metadata of the policy's file.
"""

from __future__ import annotations

import argparse
from importlib.metadata import version
from typing import Any

import snake_env
from snake_env._files import write_json
from snake_env.evaluation import rollout, scores, seeds
from snake_env.policies.loading import load_policy
from snake_env.policies.shipped import FOLDER, NAMES

SCENES = 500
ONE_SEED = "One seed of training; for general and spatial docs/results.md tells how much seeds differ."
CLONED = "Trained with self-contact, from a clone of heading control."
EARLIER = "With the time stepping before precision, commit 5929e2d,"
EVOLVED = "Trained with self-contact, from action zero, by CMA-ES."
TRAINING = {
    "corridor": "python -m training train --config corridor-cloned --seed 0",
    "field-hard": "python -m training train --config field-hard-cloned --seed 0",
    "general": "python -m training train --config general --seed 0; the best of seeds 0 to 4 on validation scenes",
    "general-randomised": "python -m training train --config general-randomised --seed 0",
    "isotropic": "python -m training train --config isotropic-evolved --seed 0",
    "perturbed": "python -m training train --config perturbed --seed 0, which trains perturbed-cloned first",
    "perturbed-randomised": "python -m training train --config perturbed-randomised --seed 0",
    "spatial": "python -m training train --config spatial --seed 4",
    "spatial-field": "python -m training train --config spatial-field --seed 0",
    "thrifty": "python -m training train --config course-evolved --seed 0",
}


SCORED_IN = {
    "general": {"difficulty": 1.0},
    "general-randomised": {"difficulty": 1.0},
    "spatial": {"goal_distance": 2.0, "max_episode_steps": 600},
}
"""Keywords of the environment on top of those of the training."""

NOTES = {
    "corridor": [
        CLONED,
        f"{EARLIER} five seeds passed 0.994 to 0.998 of the scenes at 0.338 to 0.344 m/s; this is the first.",
    ],
    "field-hard": [
        CLONED,
        f"{EARLIER} three seeds passed 0.948 to 0.956 of the scenes at 0.352 to 0.360 m/s; this is the first.",
    ],
    "general": [
        "Trained with self-contact in eight tasks at once; the scores here are those of hard fields, those of all "
        "tasks and seeds are in docs/results.md.",
        "It began from the shipped policy for perturbed courses and imitated the shipped policy of each task.",
    ],
    "perturbed": [
        CLONED,
        "It learned in perturbed courses, on the course of the thesis and in hard fields at once, then in perturbed "
        "courses alone.",
        ONE_SEED,
    ],
    "general-randomised": [
        "Trained with self-contact in eight tasks at once, with randomised friction, mass, delay and backlash; the "
        "scores here are those of hard fields with the same randomisation, those of all tasks and of five seeds are in "
        "docs/results.md.",
        "It began from general and imitated it, and on perturbed courses perturbed-randomised.",
    ],
    "perturbed-randomised": [
        "Trained with self-contact, from perturbed, with randomised friction, mass, delay and backlash; the scores "
        "here are with the same randomisation.",
        f"{EARLIER} three seeds passed 0.876 to 0.934 of the scenes at 0.270 to 0.284 m/s; this is the first.",
    ],
    "isotropic": [EVOLVED, "Five seeds reach 0.083 to 0.109 m/s on validation starts; this one 0.109."],
    "thrifty": [EVOLVED, "Five seeds differ by 1 % in cost of transport."],
    "spatial": [
        "Trained with self-contact, from random weights, with a goal out of reach; the scores are those of the "
        "environment's own goal at 2 m.",
        "It rolls. The best constant gait of a search makes 0.345 m/s.",
        f"{EARLIER} five seeds reached 0.803 to 0.864 m/s; this is the best.",
    ],
    "spatial-field": [
        "Trained with self-contact, from the weights of the planar policy general, which had no pitch angles.",
        f"{EARLIER} five seeds reached 0.958 to 0.980 of the goals at 0.381 to 0.390 m/s; this is the first.",
    ],
}
"""Where the two notes above do not hold."""


def card(name: str, scenes: int = SCENES) -> dict[str, Any]:
    """What the JSON file beside a shipped policy holds."""
    policy = load_policy(name)
    scored_in = SCORED_IN.get(name, {})
    options = policy.card.env_options | scored_in
    episodes = rollout.run_episodes(policy, policy.card.env_id, seeds.held_out(scenes), **options)
    found = scores.plain(scores.score(episodes))
    return {
        "training": TRAINING[name],
        "license": "MIT",
        "scored_in": scored_in,
        "scenes": scenes,
        "scores": {key: list(value.values()) for key, value in found.items()},
        "versions": {"snake_env": snake_env.__version__, "numpy": version("numpy"), "gymnasium": version("gymnasium")},
        "notes": NOTES.get(name, [CLONED, ONE_SEED]),
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
