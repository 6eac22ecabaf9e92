"""n robots in the Rust core, with what Python adds: checks, seeds and reward functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env import _checks, _threads
from snake_env._buffers import BufferPool, Mask, StepBuffers
from snake_env._native import Batch
from snake_env._task import Task
from snake_env.errors import ConfigError
from snake_env.options import RewardFn


class RobotState(NamedTuple):
    """All that a run changes about one robot: enough to continue it bit for bit in any batch of the same task.

    With the integrator's method "thesis" it goes on with zero impulses as first guess of the iteration.
    """

    core: bytes
    finished: bool
    previous_action: NDArray[np.float32]


class Robots:
    """A batch of robots of one task."""

    def __init__(self, task: Task, num_envs: int, num_threads: int | None, reward_fn: RewardFn | None) -> None:
        self.task = task
        self.num_envs = _checks.integer("num_envs", num_envs, 1)
        self.num_threads = _threads.resolve(num_threads, self.num_envs)
        self.native = Batch(task.config, self.num_envs, self.num_threads)
        self.everyone: Mask = np.ones(self.num_envs, np.bool_)
        self._buffers = BufferPool(self.num_envs, task.observation_space.shape[0], task.layout["signals"])
        self._reward_fn = reward_fn
        self._seeded = np.zeros(self.num_envs, np.bool_)
        self._action_shape = (self.num_envs, *task.action_space.shape)
        self._previous_action = np.zeros(self._action_shape, np.float32)

    def reset(self, mask: Mask, seeds: Sequence[int | None], rng: np.random.Generator) -> StepBuffers:
        """Starts a new episode of the robots in ``mask``, the next of its stream where the seed is None.

        The other robots report their present observation, and zeros.
        """
        buffers = self._buffers.new()
        seeds = [self._seed(i, seeds[i], rng) if mask[i] else None for i in range(self.num_envs)]
        self.native.reset(mask, seeds, buffers.arrays)
        self.native.observe(~mask, buffers.arrays.observation)
        self._previous_action[mask] = 0.0
        return buffers

    def _seed(self, i: int, seed: int | None, rng: np.random.Generator) -> int | None:
        """The seed of a robot; one that never had any takes a random one."""
        if seed is None and not self._seeded[i]:
            seed = int(rng.integers(2**63))
        self._seeded[i] = True
        return seed

    def next_episode(self, mask: Mask, buffers: StepBuffers, keep_flags: bool = False) -> None:
        """Starts the next episode of the robots in ``mask``, which have been reset before.

        Args:
            mask: (n,).
            buffers: their rows are overwritten.
            keep_flags: leave rewards and flags as they are, instead of 0 and False.
        """
        arrays = buffers.arrays
        if keep_flags:
            other = self._buffers.new().arrays
            arrays = arrays._replace(reward=other.reward, terminated=other.terminated, truncated=other.truncated)
        self.native.reset(mask, None, arrays)
        self._previous_action[mask] = 0.0

    def step(self, actions: ArrayLike, active: Mask) -> tuple[StepBuffers, int]:
        """Moves the active robots on by a control period; returns the results and how many episodes ended."""
        checked = _checks.actions(actions, self._action_shape)
        buffers = self._buffers.take()
        ended = self.native.step(checked, active, buffers.arrays)
        if self._reward_fn is not None:
            self._replace_reward(self._reward_fn, checked, active, buffers)
        return buffers, ended

    def _replace_reward(
        self, reward_fn: RewardFn, action: NDArray[np.float32], active: Mask, buffers: StepBuffers
    ) -> None:
        signals = {name: values[active] for name, values in buffers.values.items()}
        reward = np.asarray(reward_fn(signals, action[active], self._previous_action[active]), np.float64)
        expected = (int(np.count_nonzero(active)),)
        if reward.shape != expected:
            raise ConfigError("reward_fn", f"rewards of shape {reward.shape}", f"shape {expected}")
        buffers.arrays.reward[active] = reward
        self._previous_action[active] = action[active]

    def set_difficulty(self, difficulty: ArrayLike, indices: Sequence[int]) -> None:
        """Sets the difficulty of the episodes that the robots begin from now on: one for all, or one each."""
        try:
            values = np.broadcast_to(np.asarray(difficulty, np.float64), (len(indices),))
        except (TypeError, ValueError):
            raise ConfigError("difficulty", repr(difficulty), f"a number, or {len(indices)} of them") from None
        for i, value in zip(indices, values.tolist(), strict=True):
            self.native.set_difficulty(i, value)

    def observation(self) -> NDArray[np.float32]:
        """The present observations of all robots."""
        observation = self._buffers.new().arrays.observation
        self.native.observe(self.everyone, observation)
        return observation

    def get_state(self, i: int, finished: bool) -> RobotState:
        """The state of robot ``i``."""
        return RobotState(self.native.get_state(i), finished, self._previous_action[i].copy())

    def set_state(self, i: int, state: RobotState) -> None:
        """Replaces the state of robot ``i``."""
        self.native.set_state(i, state.core)
        self._previous_action[i] = state.previous_action
        self._seeded[i] = True
