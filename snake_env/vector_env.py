"""The native vector environment: all robots of a batch stepped by one call into the Rust core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import load_env_creator
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

from snake_env import _checks
from snake_env._buffers import Mask, StepBuffers
from snake_env._robot_view import METHODS, RobotView
from snake_env._robots import Functions, Robots, RobotState
from snake_env._shared import RobotsEnvironment
from snake_env._task import BATCH_KEYWORDS, Task
from snake_env.config import Scene
from snake_env.errors import ConfigError
from snake_env.options import RewardFn, TaskOptions, TerminationFn
from snake_env.picture import Picture
from snake_env.registration import MAX_EPISODE_STEPS, OWN_ID
from snake_env.state import State

StepResult = tuple[Any, NDArray[np.float64], Mask, Mask, dict[str, Any]]


class SnakeVectorEnv(RobotsEnvironment, VectorEnv):
    """n snake robots, each in a scene of its own.

    Identical, byte for byte, to ``gymnasium.vector.SyncVectorEnv`` over n single environments with the same seeds,
    whatever ``num_envs`` and ``num_threads`` are. One environment object belongs to one thread at a time.

    ``reset(seed=s)`` gives robot ``i`` the random stream ``s + i`` (or entry ``i`` of a sequence); a reset without
    seed continues the streams. ``reset(options={"reset_mask": mask})`` resets only the robots in a boolean mask.

    Arrays that a call has returned are never written again as long as anything refers to them.

    Args:
        num_envs: number of robots, >= 1.
        max_episode_steps: control periods after which an episode is truncated, >= 1; None: 600, as registered;
            -1: never.
        render_mode: None, "rgb_array" (``render`` returns a tuple of n uint8 images (height, width, 3)) or
            "human" (a window that shows robot 0).
        autoreset_mode: "NextStep", "SameStep" or "Disabled", or a member of ``gymnasium.vector.AutoresetMode``;
            strings keep the spec serialisable. Gymnasium's ``RecordEpisodeStatistics`` counts wrongly over "SameStep"
            before version 1.4.
        num_threads: threads that step the batch, >= 1; None: the environment variable SNAKE_ENV_NUM_THREADS, else
            min(cores, ceil(num_envs / 8)).
        reward_fn: replaces the reward; see :data:`snake_env.options.RewardFn`.
        termination_fn: ends episodes too; see :data:`snake_env.options.TerminationFn`.
        observation: "flat", one array (n, o), or "dict", an array for each block of the observation.
        info_state: names of arrays of :class:`snake_env.State` that the infos have as ``infos["state"][name]``.
        picture: size, camera, zoom and layers of pictures; a :class:`snake_env.Picture` or a mapping of its fields.
        **options: the task; see :class:`snake_env.options.TaskOptions`.

    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        num_threads: int | None = None,
        reward_fn: RewardFn | None = None,
        termination_fn: TerminationFn | None = None,
        observation: str = "flat",
        info_state: Sequence[str] = (),
        picture: Picture | Mapping[str, Any] | None = None,
        **options: Unpack[TaskOptions],
    ) -> None:
        self._mode = _autoreset_mode(autoreset_mode)
        limit = _checks.step_limit(max_episode_steps, MAX_EPISODE_STEPS)
        task = Task(options, limit, BATCH_KEYWORDS, observation)
        robots = Robots(task, num_envs, num_threads, Functions.checked(reward_fn, termination_fn), info_state)
        self._set_up(robots, render_mode, picture)
        self.num_envs = robots.num_envs
        self.single_observation_space = task.observation_space
        self.single_action_space = task.action_space
        self.observation_space = batch_space(task.observation_space, self.num_envs)
        self.action_space = batch_space(task.action_space, self.num_envs)
        self.metadata = {**self.metadata, "autoreset_mode": self._mode}  # type: ignore[misc]
        self._finished: Mask = np.zeros(self.num_envs, np.bool_)
        self._any_finished = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Starts new episodes, of all robots or of those in ``options["reset_mask"]``.

        Robots outside the mask keep their state and return their present observation. ``options`` may also have the
        ``scene``, ``start`` and ``goal`` of these episodes, as the keywords of the environment take them.
        ``difficulty`` is that of these robots from now on.

        A list in ``options`` has one entry per robot of the batch, None where a robot has none. As a keyword it is one
        value for all. Here a goal point of all robots is therefore a tuple or an array, ``(3.0, 1.0)``, and a path an
        array or a mapping. ``[3.0, 1.0]`` are the goal lines of two robots.

        Raises:
            ConfigError: names the seed, option or mask that is not admissible.
        """
        self._require_open()
        seeds = _checks.seeds(seed, self.num_envs)
        chosen, given = self._options(options, ["reset_mask"]), options or {}
        mask = self._robots.all_rows
        if "reset_mask" in given:
            mask = _checks.mask("options['reset_mask']", given["reset_mask"], self.num_envs)
        if self._needs_reset:
            self._require_all(mask)
        first = next((one for one in seeds if one is not None), None)
        rng = self.np_random if first is None else seeding.np_random(first)[0]
        buffers = self._robots.reset(mask, seeds, rng, chosen)
        if seed is not None and "reset_mask" not in given:
            super().reset(seed=first)
        self._set_finished(self._finished & ~mask)
        self._ready = True
        self._show()
        return self._observed(buffers.arrays.observation), self._robots.infos(buffers, mask)

    def step(self, actions: ArrayLike) -> StepResult:
        """Moves the robots on by one control period.

        Args:
            actions: (num_envs, a), real and finite, meant to lie in [-1, 1]; values beyond are clipped.

        Raises:
            ConfigError: the shape or type of the actions, or the robot and element that is not finite.
        """
        self._require_open()
        if self._needs_reset:
            raise ResetNeeded("call reset before step")
        if self._mode is AutoresetMode.NEXT_STEP:
            buffers, infos = self._step_next(actions)
        elif self._mode is AutoresetMode.SAME_STEP:
            buffers, infos = self._step_same(actions)
        else:
            buffers, infos = self._step_disabled(actions)
        self._show()
        observation, reward, terminated, truncated, *_ = buffers.arrays
        return self._observed(observation), reward, terminated, truncated, infos

    def _step_next(self, actions: ArrayLike) -> tuple[StepBuffers, dict[str, Any]]:
        """Robots that have finished start anew instead of taking a step."""
        starting = self._finished if self._any_finished else None
        active = self._robots.all_rows if starting is None else ~starting
        buffers, ended = self._robots.step(actions, active)
        if starting is not None:
            self._robots.next_episode(starting, buffers)
        self._note_ends(buffers, ended)
        return buffers, self._robots.infos(buffers)

    def _step_same(self, actions: ArrayLike) -> tuple[StepBuffers, dict[str, Any]]:
        """Robots that finish start anew within the step, and their last observation goes to the infos."""
        buffers, ended = self._robots.step(actions, self._robots.all_rows)
        if not ended:
            return buffers, self._robots.infos(buffers)
        done = buffers.arrays.terminated | buffers.arrays.truncated
        final_obs = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(done):
            final_obs[i] = self._observed(buffers.arrays.observation[i].copy())
        final = {
            "final_obs": final_obs,
            "_final_obs": done.copy(),
            "final_info": self._robots.infos(buffers, done),
            "_final_info": done.copy(),
        }
        self._robots.next_episode(done, buffers, keep_flags=True)
        return buffers, final | self._robots.infos(buffers)

    def _step_disabled(self, actions: ArrayLike) -> tuple[StepBuffers, dict[str, Any]]:
        """Robots that have finished must be reset by the caller."""
        if self._any_finished:
            # The kind of exception that SyncVectorEnv raises.
            finished = np.flatnonzero(self._finished).tolist()
            raise AssertionError(f"environments {finished} have finished: reset them with options['reset_mask']")
        buffers, ended = self._robots.step(actions, self._robots.all_rows)
        self._note_ends(buffers, ended)
        return buffers, self._robots.infos(buffers)

    def _note_ends(self, buffers: StepBuffers, ended: int) -> None:
        if ended or self._any_finished:
            self._set_finished(buffers.arrays.terminated | buffers.arrays.truncated)

    def _set_finished(self, finished: Mask) -> None:
        self._finished = finished
        self._any_finished = bool(finished.any())

    def set_difficulty(self, difficulty: ArrayLike, mask: Mask | None = None) -> None:
        """Sets the difficulty in [0, 1] of the episodes that begin from now on; for a curriculum.

        Episodes that run keep theirs: the change takes effect robot by robot, at the next reset of each.

        Args:
            difficulty: one for all robots in ``mask``, or one each, in order.
            mask: bool (n,); None: all robots.

        Raises:
            ConfigError: a number is not in [0, 1], or there are not as many as robots.
        """
        self._require_open()
        self._robots.set_difficulty(difficulty, self._indices(mask))

    def push(self, impulse: ArrayLike, mask: Mask | None = None) -> None:
        """Pushes robots: changes the momentum of each link by an impulse at its centre of gravity.

        The next step passes it on along the chain. A force F that acts for a short time t is the impulse F t.

        Args:
            impulse: (k, L, 2), in 3D (k, L, 3), for the k robots in ``mask`` [N s]. Or one (L, 2 or 3) for all of them.
                World frame.
            mask: bool (n,); None: all robots.

        Raises:
            ConfigError: the shape is another one, or a number is not finite.
        """
        self._require_open()
        self._robots.push(impulse, self._indices(mask))

    def get_state(self, mask: Mask | None = None) -> list[RobotState]:
        """The states of the robots in ``mask`` (None: all), in order."""
        self._require_open()
        return [self._robots.get_state(i, bool(self._finished[i])) for i in self._indices(mask)]

    def set_state(self, states: Sequence[RobotState], mask: Mask | None = None) -> Any:
        """Replaces the states of the robots in ``mask`` (None: all), in order; returns all present observations."""
        self._require_open()
        indices = self._indices(mask)
        count = len(states) if isinstance(states, Sequence) else None
        if count != len(indices):
            found = type(states).__name__ if count is None else f"{count} states"
            raise ConfigError("states", found, f"{len(indices)} states, one per robot in the mask")
        if self._needs_reset:
            self._require_all(self._robots.all_rows if mask is None else mask)
        self._robots.set_states(states, indices)
        finished = self._finished.copy()
        finished[indices] = [state.finished for state in states]
        self._set_finished(finished)
        self._ready = True
        return self._observed(self._robots.observation())

    def _indices(self, mask: Mask | None) -> list[int]:
        if mask is None:
            return list(range(self.num_envs))
        return [int(i) for i in np.flatnonzero(_checks.mask("mask", mask, self.num_envs))]

    def state(self) -> State:
        """The state of all robots: poses, velocities, torques, forces, goals; see :class:`snake_env.State`."""
        self._require_open()
        return self._robots.state(range(self.num_envs))

    def scene(self, i: int) -> Scene:
        """The obstacles and the ground of robot ``i``."""
        self._require_open()
        return self._robots.scene(_checks.integer("robot", i, 0, self.num_envs - 1))

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """The images of all robots ("rgb_array"); None otherwise."""
        self._require_open()
        images = self._images(range(self.num_envs))
        return None if images is None else tuple(images)

    def render_robot(self, i: int) -> NDArray[np.uint8] | None:
        """The image of robot ``i`` ("rgb_array"); None otherwise."""
        self._require_open()
        images = self._images([_checks.integer("robot", i, 0, self.num_envs - 1)])
        return None if images is None else images[0]

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Calls a method robot by robot, or reads an attribute, as Gymnasium's own vector environments do.

        Raises:
            ConfigError: it is a method of the batch, such as ``step``.
        """
        robots = [RobotView(self, i) for i in range(self.num_envs)]
        if name in METHODS or callable(getattr(self, name)):
            return tuple(robot.call(name, *args, **kwargs) for robot in robots)
        return tuple(getattr(robot, name) for robot in robots)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute, once for each robot."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets ``difficulty`` of each robot, or an attribute that the robots share to one value."""
        if name != "difficulty" and isinstance(values, list | tuple):
            expected = "one value: the robots of a native batch share their attributes"
            raise ConfigError("values", f"{len(values)} values of {name}", expected)
        setattr(self, name, values)

    @property
    def autoreset_mode(self) -> AutoresetMode:
        """When episodes restart, under the name that Gymnasium's own batches have for it."""
        return self._mode

    @property
    def num_threads(self) -> int:
        """Threads that step the batch."""
        return self._robots.num_threads

    @property
    def difficulty(self) -> NDArray[np.float64]:
        """The difficulty of the episodes to come (n,); setting it is :meth:`set_difficulty`."""
        return self._robots.difficulty

    @difficulty.setter
    def difficulty(self, value: ArrayLike) -> None:
        self.set_difficulty(value)

    def _require_open(self) -> None:
        if self.closed:
            raise ClosedEnvironmentError("this batch has been closed")

    def _require_all(self, mask: Mask) -> None:
        if not mask.all():
            raise ResetNeeded("the first reset must be of all environments")

    def close_extras(self, **kwargs: Any) -> None:
        """Closes the window, if there is one."""
        if hasattr(self, "_views"):
            self._views.close()


def refuse_others(env_id: str) -> None:
    """Refuses the ids of other packages' environments; of ids that nobody has registered Gymnasium itself says so.

    Raises:
        ConfigError: the id's batch is not a :class:`SnakeVectorEnv`.
    """
    found = gym.registry.get(env_id) if isinstance(env_id, str) else None
    if found is None:
        return
    entry = found.vector_entry_point
    made_by = load_env_creator(entry) if isinstance(entry, str) else entry
    if made_by is None or (isinstance(made_by, type) and not issubclass(made_by, SnakeVectorEnv)):
        raise ConfigError("env_id", env_id, OWN_ID)


def refuse_other_autoreset(envs: SnakeVectorEnv, library: str) -> None:
    """Refuses a batch whose episodes do not restart in the step in which they end.

    Raises:
        ConfigError: names its mode.
    """
    mode = envs.metadata["autoreset_mode"]
    if mode is not AutoresetMode.SAME_STEP:
        raise ConfigError("autoreset_mode", mode.value, f'"SameStep", the only mode of {library}')


def _autoreset_mode(value: str | AutoresetMode) -> AutoresetMode:
    if isinstance(value, AutoresetMode):
        return value
    return AutoresetMode(_checks.choice("autoreset_mode", value, [mode.value for mode in AutoresetMode]))
