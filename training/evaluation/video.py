"""Film an episode.

python -m training video --policy field-hard --seed 8589934600 --out runs/film
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from snake_env.evaluation import film, seeds
from snake_env.policies.gaits import GaitPolicy
from training.config import JsonObject
from training.evaluation import loading

STILL = {"size": (720, 432), "camera": "scene"}
"""Pictures of films in documents: 720 pixels wide, of a camera that does not move."""


@dataclass
class Options:
    """What is filmed.

    Args:
        policy: policy.safetensors or model.zip of a run; None: the gait of action zero.
        env: Environment; by default that of the policy, or SnakeField-v1.
        options: Keywords of the environment.
        seed: Of the episode; by default the first held-out one.
        out: File, .mp4 or .gif; without an ending .mp4 is added.
    """

    policy: Path | None = None
    env: str | None = None
    options: JsonObject = field(default_factory=dict)
    seed: int = seeds.HELD_OUT.start
    out: Path = Path("runs/episode")


def answer_film(args: Options) -> int:
    """Plays and writes one episode."""
    paths = [] if args.policy is None else [args.policy]
    env_id, options = loading.task(args.env, args.options, paths)
    loading.refuse_other_model(paths, env_id, options)
    policies = loading.load_models(paths) or [GaitPolicy()]
    args.out.parent.mkdir(parents=True, exist_ok=True)
    print(film.write(film.play(policies[0], env_id, args.seed, render_mode="rgb_array", **options).frames, args.out))
    return 0


def write_small_gif(frames: list[NDArray[np.uint8]], path: Path) -> Path:
    """Writes every third frame and the last, in the same few colours: small if they were drawn as ``STILL``."""
    return film.write_gif([*frames[:-1:3], frames[-1]], path, milliseconds=150)
