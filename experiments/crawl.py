"""Random actions and policies in a batch of environments, whose robots are judged at every control instant."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env import SnakeVectorEnv
from snake_env.policies.interface import Policy

HELD = (1, 2, 20)
"""Control periods for which a random action is held; robots differ in it."""


@dataclass
class Crawl:
    """The outcome of random actions in one scene.

    Args:
        steps: Robot-steps.
        overlap: Deepest overlap with each kind of thing at a control instant [m].
        beyond: Robot-steps with an overlap of more than a millimetre.
        crossings: Robot-steps in which a link passed through a peg, a wall or another link.
        flagged: Robot-steps that ended with a flagged robot.
    """

    steps: int = 0
    overlap: tuple[float, ...] = ()
    beyond: int = 0
    crossings: int = 0
    flagged: int = 0

    def add_gaps(self, gaps: list[NDArray[np.float64]]) -> None:
        """Adds the smallest gap (n,) of every robot to each kind of thing [m]."""
        deepest = self.overlap or (0.0,) * len(gaps)
        self.overlap = tuple(max(a, float(-gap.min(initial=0.0))) for a, gap in zip(deepest, gaps, strict=True))
        self.beyond += int((np.minimum.reduce(gaps) < -1e-3).sum())


class Bodies(Protocol):
    """Poses of all robots of a batch, now and at the instant before."""

    def read(self, moved: NDArray[np.bool_]) -> None:
        """Reads the poses, and the obstacles of the robots that were placed anew."""

    def judge(self, found: Crawl, judged: NDArray[np.bool_]) -> None:
        """Adds overlaps and crossings of these robots."""


def crawl(envs: SnakeVectorEnv, bodies_of: Callable[[SnakeVectorEnv], Bodies], steps: int, seed: int = 0) -> Crawl:
    """Random actions for about ``steps`` robot-steps; closes the environments."""
    envs.reset(seed=seed)
    bodies, found = bodies_of(envs), Crawl()
    ended = np.zeros(envs.num_envs, dtype=bool)
    for action in random_actions(envs.action_space, max(1, steps // envs.num_envs), seed):
        _, _, terminated, truncated, info = envs.step(action)
        bodies.read(ended)
        _judge(found, bodies, ~ended, info)
        ended = terminated | truncated
    envs.close()
    return found


def play(
    envs: SnakeVectorEnv, bodies_of: Callable[[SnakeVectorEnv], Bodies], policy: Policy, starts: list[int]
) -> Crawl:
    """A policy's first episodes of these seeds, in environments without automatic reset, which it closes."""
    observation, _ = envs.reset(seed=starts)
    policy.begin(envs.layout, len(starts))
    bodies, found = bodies_of(envs), Crawl()
    running = np.ones(len(starts), dtype=bool)
    while running.any():
        observation, _, terminated, truncated, info = envs.step(policy(observation))
        bodies.read(~running)
        _judge(found, bodies, running, info)
        ended = terminated | truncated
        running &= ~ended
        if ended.any():
            observation, _ = envs.reset(options={"reset_mask": ended})
    envs.close()
    return found


def _judge(found: Crawl, bodies: Bodies, stepped: NDArray[np.bool_], info: dict[str, Any]) -> None:
    flagged = info["diverged"] | info["penetrated"]
    found.steps += int(stepped.sum())
    found.flagged += int((flagged & stepped).sum())
    bodies.judge(found, stepped & ~flagged)


def random_actions(space: gym.Space[Any], steps: int, seed: int) -> Iterator[NDArray[np.float32]]:
    """Actions (n, m) of each step: uniform or, as often, at their limits, held for as long as `HELD` tells."""
    rng = np.random.default_rng(seed)
    assert space.shape is not None, "a box"
    action = np.zeros(space.shape)
    held = np.resize(HELD, len(action))
    for step in range(steps):
        fresh = step % held == 0
        uniform, extreme = rng.uniform(-1, 1, action[fresh].shape), rng.choice([-1.0, 1.0], action[fresh].shape)
        action[fresh] = np.where(rng.random((fresh.sum(), 1)) < 0.5, uniform, extreme)
        yield action.astype(np.float32)
