"""An entry of the benchmark: ``entry.json`` in a folder, beside the policies that it names.

A policy is a file of the folder that runs no code when it is read, or the name of a shipped or scripted one.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from pydantic import Field

from snake_env import ConfigError, _documents
from snake_env._files import write_text
from snake_env.evaluation import tracks
from snake_env.policies.loading import GAIT, SCRIPTED
from snake_env.policies.shipped import NAMES
from training import config as configs
from training.config import Count, NotNegative, Section, Share

NAME = "entry.json"

SUFFIXES = (".safetensors", ".onnx")
"""Of policies that run no code when they are read."""


class Scores(Section):
    """One run in one task.

    Args:
        success: Share of the episodes that reach the goal.
        speed: Mean over all episodes [m/s].
        speed_deviation: Standard deviation of that over episodes [m/s].
        score: Mean of the speed where the goal is reached, else zero [m/s].
        cost_of_transport: Work over weight times distance, of all episodes together; None: no progress.
        contact_free: Share of the progress made while nothing pushed; None: no progress, or not measured.
        chatter: Mean share of the power of the actions above 4 Hz; None: not measured.
        failed: Episodes that diverged or penetrated.
    """

    success: Share
    speed: float
    speed_deviation: NotNegative
    score: float
    cost_of_transport: float | None
    contact_free: float | None = None
    chatter: Share | None = None
    failed: int


class Run(Section):
    """One training, or a scripted policy.

    Args:
        policy: File in the folder, or name.
        seed: Of the training; None: unknown, or none.
        steps: Environment steps of the training and of all that it builds on; None: unknown.
        seconds: Wall time of the training without what it builds on; None: unknown.
        machine: Where it was trained; None: unknown.
        scores: By task.
    """

    policy: str
    seed: int | None = None
    steps: int | None = None
    seconds: float | None = None
    machine: dict[str, Any] | None = None
    scores: dict[str, Scores] = Field(default_factory=dict)


class Submission(Section):
    """What ``entry.json`` has.

    Args:
        about: One line.
        robot_class: Class of robot.
        track: Track.
        blocks: Everything that the policies observe.
        env_options: Keywords of the environment that a name does not bring along.
        episodes: Scenes of each run in each task.
        first_scene: Number of the first of them.
        versions: Of what the scores were computed with.
        runs: One per training.
    """

    about: str
    robot_class: str
    track: str
    blocks: tuple[str, ...]
    env_options: dict[str, Any] = Field(default_factory=dict)
    episodes: Count
    first_scene: int = 0
    versions: dict[str, Any]
    runs: tuple[Run, ...]

    @property
    def tasks(self) -> list[str]:
        """Those that it plays in, the same for all runs."""
        return list(self.runs[0].scores)


def read(folder: Path) -> Submission:
    """The entry in a folder.

    Raises:
        ConfigError: there is none, or its blocks, track or policies are not admissible.
    """
    path = folder / NAME
    try:
        text = path.read_text()
        _documents.of_json(text)
    except (OSError, ValueError) as error:
        raise ConfigError("folder", str(folder), f"one with {NAME} ({error})") from None
    with configs.checked(Submission):
        found = Submission.model_validate_json(text)
    tracks.require(found.track, found.blocks)
    for run in found.runs:
        policy(folder, run)
    if not found.runs or any(list(run.scores) != found.tasks for run in found.runs):
        raise ConfigError("runs", str(path), "at least one, all in the same tasks")
    return found


def write(folder: Path, submission: Submission) -> None:
    """Writes ``entry.json``."""
    write_text(folder / NAME, submission.model_dump_json(indent=2) + "\n")


def policy(folder: Path, run: Run) -> str:
    """What :func:`snake_env.load_policy` takes for a run.

    Raises:
        ConfigError: it could run code when it is read, or lies elsewhere.
    """
    path = folder / run.policy
    if is_named(run.policy):
        return run.policy
    if Path(run.policy).name != run.policy or path.suffix not in SUFFIXES or not path.is_file():
        expected = f"a shipped or scripted policy, or a file of {folder} that ends in {' or '.join(SUFFIXES)}"
        raise ConfigError("policy", run.policy, expected)
    return str(path)


def is_named(text: str) -> bool:
    """Whether it is a shipped or scripted policy, or a gait by its numbers."""
    return text in (GAIT, *SCRIPTED, *NAMES) or re.fullmatch(r"-?[\d.]+(,-?[\d.]+){2}", text) is not None
