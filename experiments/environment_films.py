"""Films and pictures of the environments: one film per id, those of the policies in 3D, and the gallery of all families
of scenes.

A film shows a test scene in real time, the episode that ``snake-env evaluate`` scores.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env import card
from snake_env.commands.environment_pages import Film
from snake_env.drawing import figure, save, style
from snake_env.evaluation import film, seeds, tasks
from snake_env.policies.gaits import ConstantAction
from snake_env.policies.interface import Policy
from snake_env.policies.loading import load_policy
from snake_env.registration import SCENARIOS, TASKS

SIZE = (640, 384)
LONGEST = 8.0
"""Part of an episode that a film shows [s]."""
PERIOD = 0.05
"""Control period of every environment [s]."""
STRIP_HEIGHT = 110
"""Of the view from the side, below that from above [pixels]."""
DIFFICULTIES = (0.0, 0.5, 1.0)
POLICIES = {"spatial-field": Film("spatial-field", 0, tasks.load()["spatial-field"].options)}
"""Films of what policies have learned in 3D, for docs/results.md."""


def write_film(env_id: str, shown: Film, path: Path) -> Path:
    """An episode as an animated picture."""
    height = SIZE[1] - (STRIP_HEIGHT if "spatial" in TASKS[env_id].values() else 0)
    picture = {"size": (SIZE[0], height), **_camera(env_id)}
    seed = seeds.HELD_OUT[shown.scene]
    episode = film.play(actor(env_id, shown), env_id, seed, render_mode="rgb_array", picture=picture, **shown.options)
    return film.write_gif(episode.frames[: round(LONGEST / PERIOD)], path, milliseconds=round(1000 * PERIOD))


def actor(env_id: str, shown: Film) -> Policy:
    """What acts in a film."""
    if shown.policy == "action zero":
        size = len(card.layout_of(**TASKS[env_id])["action"])
        return ConstantAction(np.zeros(size, np.float32), shown.policy)
    return load_policy(shown.policy, task="maze")  # where heading control is on the same ground


def _camera(env_id: str) -> dict[str, Any]:
    """Everything at once where the goal is a point, else the way ahead of the robot."""
    task, model = TASKS[env_id]["task"], TASKS[env_id].get("model")
    if task in ("maze", "corridor"):
        return {"camera": "scene"}
    if task == "command":
        return {"camera": "fixed", "zoom": 0.55, "centre": (1.0, 0.75)}
    if task in ("pipe", "climb"):
        return {"camera": "fixed", "zoom": 0.58, "centre": (0.9, 0.0), "force_scale": 0.002}
    if model == "spatial":
        return {"camera": "fixed", "zoom": 0.36, "centre": (0.9, 0.0)}
    if task in ("course", "perturbed"):
        return {"camera": "fixed", "zoom": 0.72, "centre": (1.55, 0.1)}
    return {"camera": "fixed", "zoom": 0.68, "centre": (0.8, 0.0)}


def write_gallery(path: Path) -> Path:
    """The starts of test scene 0 of every family, at three difficulties where the family has them."""
    families = {family["id"]: _starts(family["id"]) for family in SCENARIOS}
    families["SnakeSpatial-v1"] = _starts("SnakeSpatial-v1")
    # Whole rows first.
    tiles = [
        (env_id if len(starts) == 1 else f"{env_id}, difficulty {difficulty:g}", image)
        for env_id, starts in sorted(families.items(), key=lambda item: -len(item[1]))
        for difficulty, image in starts.items()
    ]
    rows = -(-len(tiles) // len(DIFFICULTIES))
    with style():
        drawn, axes = figure(rows, len(DIFFICULTIES), 9.6, 2.15 * rows)
        for cell in axes.flat:
            cell.axis("off")
        for cell, (title, image) in zip(axes.flat, tiles, strict=False):
            cell.imshow(image, interpolation="lanczos")
            cell.set_title(title)
        return save(drawn, path)


def _starts(env_id: str) -> dict[float, NDArray[np.uint8]]:
    """Pictures by difficulty, without those that show the same."""
    pictures: dict[float, NDArray[np.uint8]] = {}
    height = 480 - (STRIP_HEIGHT if "spatial" in TASKS[env_id].values() else 0)
    for difficulty in DIFFICULTIES:
        picture = {"size": (800, height), "layers": ("grid", "goal", "obstacles", "links"), **_camera(env_id)}
        keywords: dict[str, Any] = {"render_mode": "rgb_array", "difficulty": difficulty, "picture": picture}
        env: Any = gym.make_vec(env_id, 1, num_threads=1, **keywords)
        env.reset(seed=[seeds.HELD_OUT.start])
        image = env.render()[0]
        env.close()
        if not any(np.array_equal(image, other) for other in pictures.values()):
            pictures[difficulty] = image
    return pictures
