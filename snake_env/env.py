"""A single environment: a batch of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

from snake_env import _checks, _worlds
from snake_env._robots import Functions, Robots, RobotState
from snake_env._shared import RobotsEnvironment
from snake_env._task import Task
from snake_env.config import Scene
from snake_env.options import RewardFn, TaskOptions, TerminationFn
from snake_env.picture import Picture
from snake_env.state import State


class SnakeEnv(RobotsEnvironment, gym.Env[Any, NDArray[np.float32]]):
    """One snake robot; equal to robot 0 of a :class:`snake_env.SnakeVectorEnv` of any size.

    Args:
        max_episode_steps: control periods after which an episode is truncated, >= 1; None or -1: never
            (``gymnasium.make`` adds a time limit of its own).
        render_mode: None, "rgb_array" (``render`` returns a uint8 image (height, width, 3)) or "human" (a window).
        reward_fn: replaces the reward; see :data:`snake_env.options.RewardFn`.
        termination_fn: ends episodes too; see :data:`snake_env.options.TerminationFn`.
        observation: "flat", one array, or "dict", an array for each block of the observation.
        info_state: names of arrays of :class:`snake_env.State` that ``info["state"]`` has.
        picture: size, camera, zoom and layers of pictures; a :class:`snake_env.Picture` or a mapping of its fields.
        **options: the task; see :class:`snake_env.options.TaskOptions`.
    """

    def __init__(
        self,
        *,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        reward_fn: RewardFn | None = None,
        termination_fn: TerminationFn | None = None,
        observation: str = "flat",
        info_state: Sequence[str] = (),
        picture: Picture | Mapping[str, Any] | None = None,
        **options: Unpack[TaskOptions],
    ) -> None:
        limit = _checks.step_limit(max_episode_steps, None)
        task = Task(options, limit, observation=observation)
        functions = Functions.checked(reward_fn, termination_fn)
        self._set_up(Robots(task, 1, 1, functions, info_state), render_mode, picture)
        self.observation_space = task.observation_space
        self.action_space = task.action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Starts a new episode: the first of the stream ``seed``, or the next of the present stream.

        ``options`` has the ``scene``, ``start`` and ``goal`` of this episode, whatever the keywords of the environment
        take, and the ``difficulty`` from now on.

        Raises:
            ConfigError: names the seed or the option that is not admissible.
        """
        seeds = _checks.seeds(None if seed is None else _checks.seed(seed), 1)
        buffers = self._robots.reset(self._robots.all_rows, seeds, self.np_random, self._options(options))
        super().reset(seed=seeds[0])
        self._ready = True
        self._show()
        return self._observed(buffers.arrays.observation[0]), self._robots.info(buffers)

    def _prescribed(self, options: Mapping[str, Any]) -> list[dict[str, Any]]:
        """One robot has no list of one entry per robot: a list is what it is as a keyword, such as a point."""
        return [_worlds.given(options)]

    def step(self, action: ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Moves the robot on by one control period.

        Args:
            action: (a,), real and finite, meant to lie in [-1, 1]; values beyond are clipped.

        Raises:
            ConfigError: the shape or type of the action, or the element that is not finite.
        """
        if self._needs_reset:
            raise ResetNeeded("call reset before step")
        checked = _checks.actions(action, self._robots.task.action_space.shape)
        _checks.finite("action", checked)
        buffers, _ = self._robots.step(checked[np.newaxis], self._robots.all_rows)
        self._show()
        observation, reward, terminated, truncated, *_ = buffers.arrays
        return (
            self._observed(observation[0]),
            float(reward[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            self._robots.info(buffers),
        )

    def set_difficulty(self, difficulty: float) -> None:
        """Sets the difficulty in [0, 1] of the episodes that begin from now on; for a curriculum.

        Raises:
            ConfigError: it is not in [0, 1].
        """
        self._robots.set_difficulty(difficulty, [0])

    @property
    def difficulty(self) -> float:
        """The difficulty of the episodes to come; setting it is :meth:`set_difficulty`."""
        return float(self._robots.difficulty[0])

    @difficulty.setter
    def difficulty(self, value: float) -> None:
        self.set_difficulty(value)

    def push(self, impulse: ArrayLike) -> None:
        """Pushes the robot: changes the momentum of each link by an impulse at its centre of gravity.

        Args:
            impulse: (L, 2) in the plane, (L, 3) in 3D; world frame [N s].

        Raises:
            ConfigError: the shape is another one, or a number is not finite.
        """
        self._robots.push(impulse, [0])

    def get_state(self) -> RobotState:
        """All that a run changes about the robot."""
        return self._robots.get_state(0, False)

    def set_state(self, state: RobotState) -> Any:
        """Replaces the state of the robot; returns its observation."""
        self._robots.set_states([state], [0])
        self._ready = True
        return self._observed(self._robots.observation()[0])

    def state(self) -> State:
        """Pose, velocities, torques, forces and goal; see :class:`snake_env.State`."""
        return self._robots.state([0]).robot(0)

    def scene(self) -> Scene:
        """The obstacles and the ground."""
        return self._robots.scene(0)

    def render(self) -> NDArray[np.uint8] | None:
        """The image of the robot ("rgb_array"); None otherwise."""
        images = self._images([0])
        return None if images is None else images[0]

    def close(self) -> None:
        """Closes the window, if there is one; the environment itself can still be used."""
        self._views.close()
