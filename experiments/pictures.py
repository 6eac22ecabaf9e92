"""The pictures of the documents: which are stale, and how they are drawn again.

    python -m experiments.pictures                    # draw those that are stale: `make pictures`
    python -m experiments.pictures --check            # only tell which are stale and why; exit status 1 if one is
    python -m experiments.pictures --only env-field.gif course.png

Every PNG and GIF file of docs/images holds what it was made from (:mod:`experiments.origin`); it is stale if that has
changed. :mod:`experiments.picture_list` lists them, and those that are final. Three need Chromium and
playwright, two of these also `make playground`.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import shutil
import sys
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from experiments import environment_films, origin
from experiments.origin import Array
from experiments.picture_list import IMAGES, pictures
from snake_env.commands.environment_pages import Film
from snake_env.evaluation import film, seeds
from snake_env.obstacles import circles
from snake_env.policies.scripted import catalogue
from snake_env.policies.shipped import NAMES, policy_path
from snake_env.reproduce.experiments import experiments

SCRIPTED, EPISODE = 2.0, 1.0
"""Compared of an experiment, which rounds alike on every processor, and of an episode, where a policy may not [s]."""
TOLERANCES = 1e-5, 1e-3
"""Of their numbers [m]: less than shows; changes of actions by 1e-7 grow to 1e-4 in most episodes, to 2e-3 in one."""


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 1 if a picture is or stays stale."""
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--only", nargs="+", choices=list(pictures()), metavar="FILE", help="draw these, stale or not")
    cli.add_argument("--check", action="store_true", help="draw nothing")
    args = cli.parse_args(arguments)
    left = 0
    for name in args.only or pictures():
        reasons = stale(name)
        if not reasons and not args.only:
            continue
        if args.check:
            print(f"{name} is stale: {'; '.join(reasons)}")
            left += 1
            continue
        start = time.monotonic()
        try:
            redraw(name)
            print(f"{name}: drawn in {time.monotonic() - start:.1f} s", flush=True)
        except Exception as error:  # a browser that is missing must not keep the others from being drawn
            print(f"{name}: not drawn, {type(error).__name__}: {str(error).partition(chr(10))[0]}", flush=True)
            left += 1
    return 1 if left else 0


def redraw(name: str, folder: Path = IMAGES) -> None:
    """Draws a picture with its record, whole or not at all."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / name
        shown = pictures()[name].draw(path)
        origin.write(path, present(name, shown))
        shutil.copyfile(path, folder / f".{name}")
    os.replace(folder / f".{name}", folder / name)


def stale(name: str, folder: Path = IMAGES) -> list[str]:
    """Why a picture is stale; empty if it is not."""
    path = folder / name
    if not path.exists():
        return ["it does not exist"]
    stored = origin.read(path)
    shown = tuple((stored or {}).get("runs", ()))
    return list(origin.differences(stored, present(name, shown), tolerance))


def present(name: str, shown: tuple[str, ...]) -> origin.Record:
    """What a picture that shows these runs would be made from now."""
    picture = pictures()[name]
    return {
        "command": f"python -m experiments.pictures --only {name}",
        "policies": {policy: origin.digest(_policy(policy)) for policy in picture.policies},
        "configuration": origin.digest(picture.configuration),
        "code": origin.code(*picture.code),
        "runs": {run: origin.run(beginning(run)) for run in shown},
    }


def _policy(name: str) -> Any:
    """The file of a shipped policy, or the numbers of a scripted controller for a task."""
    controller, _, task = name.partition(", ")
    return policy_path(name).read_bytes() if name in NAMES else catalogue.chosen(controller, task)


def tolerance(run: str) -> float:
    """Of the numbers of a run [m]."""
    return TOLERANCES[run not in experiments()]


@cache
def beginning(run: str) -> Array:
    """Numbers that tell the first seconds of a run: places of links or of the CG, and the mean peg [m].

    Args:
        run: an experiment of the reproduction, or an :func:`experiments.picture_list.episode`; one that no longer
            exists has no numbers.
    """
    if run in experiments():
        experiment = experiments()[run]
        short = dataclasses.replace(experiment, duration=min(experiment.duration, SCRIPTED))
        position = short.simulate(sample=0.1).position
        return position[[len(position) // 2, -1]]
    if not run.startswith("["):
        return np.empty(0)
    policy, env_id, scene, options = json.loads(run)
    actor = environment_films.actor(env_id, Film(policy, scene, options))
    options["max_episode_steps"] = round(EPISODE / environment_films.PERIOD)
    episode = film.play(actor, env_id, seeds.HELD_OUT[scene], **options)
    pegs = circles(episode.scene.obstacles)
    return np.concatenate([episode.walk[::5].ravel(), np.mean(pegs, axis=0) if len(pegs) else []])


if __name__ == "__main__":
    sys.exit(main())
