"""A single environment: a batch of one."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

from snake_env import _checks
from snake_env._robots import Robots, RobotState
from snake_env._shared import RobotsEnvironment
from snake_env._task import Task
from snake_env.options import RewardFn, TaskOptions


class SnakeEnv(RobotsEnvironment, gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One snake robot; equal to robot 0 of a :class:`snake_env.SnakeVectorEnv` of any size.

    Args:
        max_episode_steps: control periods after which an episode is truncated, >= 1; None: never
            (``gymnasium.make`` adds a time limit of its own).
        render_mode: None, "rgb_array" (``render`` returns a uint8 image (height, width, 3)) or "human" (a window).
        reward_fn: replaces the reward; see :data:`snake_env.options.RewardFn`.
        **options: the task; see :class:`snake_env.options.TaskOptions`.

    Attributes:
        control_period: simulated time of one step [s].
    """

    def __init__(
        self,
        *,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        reward_fn: RewardFn | None = None,
        **options: Unpack[TaskOptions],
    ) -> None:
        task = self._set_up(Robots(Task(options, max_episode_steps), 1, 1, reward_fn), render_mode)
        self.observation_space = task.observation_space
        self.action_space = task.action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Starts a new episode: the first of the stream ``seed``, or the next of the present stream.

        Raises:
            ConfigError: names the seed that is not admissible, or an option; there are none.
        """
        self._require_open()
        seeds = _checks.seeds(None if seed is None else _checks.seed(seed), 1)
        _checks.options(options, [])
        super().reset(seed=seeds[0])
        buffers = self._robots.reset(self._robots.everyone, seeds, self.np_random)
        self._ready = True
        self._show()
        return buffers.arrays.observation[0], buffers.numbers()

    def step(self, action: ArrayLike) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Moves the robot on by one control period.

        Args:
            action: (a,), real and finite, meant to lie in [-1, 1]; values beyond are clipped.

        Raises:
            ConfigError: the shape or type of the action, or the element that is not finite.
        """
        self._require_open()
        if not self._ready:
            raise ResetNeeded("call reset before step")
        checked = _checks.actions(action, self._robots.task.action_space.shape)
        buffers, _ = self._robots.step(checked[np.newaxis], self._robots.everyone)
        self._show()
        observation, reward, terminated, truncated, *_ = buffers.arrays
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), buffers.numbers()

    def set_difficulty(self, difficulty: float) -> None:
        """Sets the difficulty in [0, 1] of the episodes that begin from now on; for a curriculum.

        Raises:
            ConfigError: it is not in [0, 1].
        """
        self._require_open()
        self._robots.set_difficulty(difficulty, [0])

    def get_state(self) -> RobotState:
        """All that a run changes about the robot."""
        self._require_open()
        return self._robots.get_state(0, False)

    def set_state(self, state: RobotState) -> NDArray[np.float32]:
        """Replaces the state of the robot; returns its observation."""
        self._require_open()
        self._robots.set_state(0, state)
        self._ready = True
        return self._robots.observation()[0]

    def render(self) -> NDArray[np.uint8] | None:
        """The image of the robot ("rgb_array"); None otherwise."""
        images = self._images([0])
        return None if images is None else images[0]

    def close(self) -> None:
        """Closes the window, if there is one; a second call does nothing."""
        self.closed = True
        self._views.close()
