"""The best constant gait: a search over (A, omega, beta), many gaits and fields in one batch."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training import seeds
from training.policies.gaits import DEGREE, ConstantAction, GaitParameters
from training.rollout import layout_of, run_episodes

AMPLITUDES = (20, 30, 40, 50, 60)
OMEGAS = (80, 110, 140, 170, 200)
BETAS = (-65, -50, -40, -32, -25)
"""Default grid [deg, deg/s, deg]; it holds the thesis's gait."""


@dataclass(frozen=True)
class Round:
    """One round of the search: all gaits left are tried on the same fields, the best go on.

    Args:
        fields: fields for each gait.
        keep: gaits that go on; ties go to the one listed first.
    """

    fields: int
    keep: int


ROUNDS = (Round(4, 20), Round(16, 5), Round(48, 1))
"""125 gaits on 4 fields, the best 20 on 16 others, the best 5 on 48 others."""
SHOW_SECONDS = 5.0
"""Between two lines of progress."""


@dataclass(frozen=True)
class Search:
    """Result of a search.

    Attributes:
        gaits: all gaits of the grid.
        progress: mean progress of each in the last round it took part in [m].
        success: share of fields passed in that round.
        best: the winner.
    """

    gaits: list[GaitParameters]
    progress: NDArray[np.float64]
    success: NDArray[np.float64]
    best: GaitParameters


def grid(
    amplitudes: Sequence[float] = AMPLITUDES, omegas: Sequence[float] = OMEGAS, betas: Sequence[float] = BETAS
) -> list[GaitParameters]:
    """All combinations; arguments in degrees and degrees per second."""
    combinations = itertools.product(amplitudes, omegas, betas)
    return [GaitParameters(a * DEGREE, omega * DEGREE, beta * DEGREE) for a, omega, beta in combinations]


def search(
    gaits: list[GaitParameters],
    env_id: str,
    rounds: Sequence[Round] = ROUNDS,
    num_threads: int | None = None,
    show: bool = False,
    **options: Any,
) -> Search:
    """Finds the gait of most progress on the fields meant for choosing.

    Args:
        gaits: candidates.
        env_id: environment; its torque limit holds for every gait.
        rounds: each on fields of its own.
        num_threads: threads of the simulator.
        show: prints a line for each round, and one of progress every few seconds.
        **options: keywords of the environment.
    """
    progress, success = np.zeros(len(gaits)), np.zeros(len(gaits))
    left = np.arange(len(gaits))
    skip = 0
    for number, part in enumerate(rounds, 1):
        fields = seeds.selection(part.fields, skip)
        skip += part.fields
        if show:
            print(f"round {number} of {len(rounds)}: {len(left)} gaits on {part.fields} fields each", flush=True)
        progress[left], success[left] = _try([gaits[k] for k in left], env_id, fields, num_threads, show, options)
        left = left[np.argsort(-progress[left], kind="stable")[: part.keep]]
    return Search(gaits, progress, success, gaits[left[0]])


def _try(
    gaits: list[GaitParameters],
    env_id: str,
    fields: list[int],
    num_threads: int | None,
    show: bool,
    options: dict[str, Any],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean progress [m] and share of success of each gait on the same fields."""
    entries = layout_of(env_id, options | {"action_mode": "gait"})["action"]
    actions = np.array([gait.action(entries) for gait in gaits])
    kind = _Shown if show else ConstantAction
    policy = kind(np.repeat(actions, len(fields), axis=0), "gaits", {"action_mode": "gait"})
    episodes = run_episodes(policy, env_id, fields * len(gaits), num_threads, **options)
    shape = (len(gaits), len(fields))
    return episodes["distance"].reshape(shape).mean(axis=1), episodes["is_success"].reshape(shape).mean(axis=1)


class _Shown(ConstantAction):
    """Says every few seconds how many control periods it has acted in."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Counts from zero."""
        self._limit = layout["config"]["max_episode_steps"]
        self._steps, self._said = 0, time.monotonic()

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions (n, a)."""
        if time.monotonic() - self._said >= SHOW_SECONDS:
            print(f"{self._steps} of at most {self._limit} steps", flush=True)
            self._said = time.monotonic()
        self._steps += 1
        return super().__call__(observation)
