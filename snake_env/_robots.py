"""n robots in the Rust core, with what Python adds: checks, seeds and reward functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env import _checks, _threads
from snake_env._buffers import Arrays, BufferPool, Mask, StepBuffers
from snake_env._native import Batch
from snake_env._task import Task
from snake_env.config import Scene
from snake_env.errors import ConfigError
from snake_env.options import RewardFn, TerminationFn
from snake_env.state import State, in_infos, state_of


class RobotState(NamedTuple):
    """All that a run changes about one robot: enough to continue it bit for bit in any batch of the same task."""

    core: bytes
    finished: bool
    previous_action: NDArray[np.float32]
    config: Mapping[str, Any]
    """Of the environment that it is from, with all defaults."""


class Functions(NamedTuple):
    """Functions of the user's, called after each step."""

    reward: RewardFn | None = None
    termination: TerminationFn | None = None

    @classmethod
    def checked(cls, reward_fn: RewardFn | None, termination_fn: TerminationFn | None) -> Functions:
        """Both can be called, or are None."""
        arguments = "(state, action, previous_action)"
        return cls(
            _checks.function("reward_fn", reward_fn, f"reward_fn{arguments}"),
            _checks.function("termination_fn", termination_fn, f"termination_fn{arguments}"),
        )


class Options(NamedTuple):
    """Options of a reset."""

    worlds: Sequence[Mapping[str, Any]] | None = None
    """What is prescribed for each robot's episode."""
    difficulty: Any = None
    """Of the robots that are reset, from now on."""


class Robots:
    """A batch of robots of one task."""

    def __init__(
        self,
        task: Task,
        num_envs: int,
        num_threads: int | None,
        functions: Functions,
        info_state: Sequence[str] = (),
    ) -> None:
        self.task = task
        self._info_state = _checks.names("info_state", info_state, [row["name"] for row in task.layout["state"]])
        self.num_envs = _checks.integer("num_envs", num_envs, 1)
        self.num_threads = _threads.resolve(num_threads, self.num_envs)
        self.native = Batch(task.config, self.num_envs, self.num_threads)
        self.all_rows: Mask = np.ones(self.num_envs, np.bool_)
        has_own_reward = functions.reward is not None
        self._buffers = BufferPool(self.num_envs, task.observation_size, task.layout["signals"], has_own_reward)
        self._functions = functions
        self._calls_functions = any(function is not None for function in functions)
        self._seeded = np.zeros(self.num_envs, np.bool_)
        self._action_shape = (self.num_envs, *task.action_space.shape)
        self._previous_action = np.zeros(self._action_shape, np.float32)
        if task.worlds.is_prescribed:
            self._prescribe([0], [0])

    def reset(
        self,
        mask: Mask,
        seeds: Sequence[int | None],
        rng: np.random.Generator,
        options: Options | None = None,
        buffers: StepBuffers | None = None,
    ) -> StepBuffers:
        """Starts a new episode of the robots in ``mask``, the next of its stream where the seed is None.

        The other robots report their present observation, and what ``buffers`` has of them: None, new ones with zeros.
        A refused reset changes nothing.
        """
        unseeded = [i for i in np.flatnonzero(mask & ~self._seeded).tolist() if seeds[i] is None]
        random_state = rng.bit_generator.state if unseeded else None
        drawn = {i: int(rng.integers(2**63)) for i in unseeded}
        seeds = [drawn.get(i, seeds[i]) if mask[i] else None for i in range(self.num_envs)]
        try:
            self._prepare(mask, seeds, options or Options())
        except Exception:
            if random_state is not None:
                rng.bit_generator.state = random_state
            raise
        buffers = buffers or self._buffers.new()
        self._begin(mask, seeds, buffers.arrays)
        self.native.observe(~mask, buffers.arrays.observation)
        self._seeded |= mask
        self._previous_action[mask] = 0.0
        return buffers

    def _begin(self, mask: Mask, seeds: list[int | None] | None, arrays: Arrays) -> None:
        """Starts episodes; pegs that are to have friction get it once they are drawn, and the episode starts again."""
        self.native.reset(mask, seeds, arrays)
        if not self.task.worlds.has_rough_pegs:
            return
        rows = np.flatnonzero(mask).tolist()
        state = self.state(rows)
        worlds = {}
        for k, i in enumerate(rows):
            if world := self.task.worlds.rough(self.native.next_episode(i), self.scene(i), state.robot(k)):
                worlds[i] = world
        if worlds:
            self.native.set_next_worlds(list(worlds), list(worlds.values()))
            again = np.isin(np.arange(self.num_envs), list(worlds))
            self.native.reset(again, seeds, arrays)

    def _prepare(self, mask: Mask, seeds: Sequence[int | None], options: Options) -> None:
        """Sets difficulties and prescribes where episodes take place, or does neither."""
        rows, before = np.flatnonzero(mask).tolist(), self.difficulty
        if options.difficulty is not None:
            given = _checks.reals("difficulty", options.difficulty, f"a number, or {len(rows)} of them")
            self.set_difficulty(given[mask] if given.shape == mask.shape else given, rows)
        try:
            if options.worlds is not None or self.task.worlds.is_prescribed:
                self._prescribe(rows, seeds, options.worlds)
        except Exception:
            self.set_difficulty(before, range(self.num_envs))
            raise

    def _prescribe(
        self,
        rows: Sequence[int],
        seeds: Sequence[int | None] | None = None,
        options: Sequence[Mapping[str, Any]] | None = None,
    ) -> None:
        """Prescribes where the next episodes of some robots take place, or none of them."""
        difficulty = self.difficulty
        worlds = {}
        for i in rows:
            seed = None if seeds is None else seeds[i]
            episode = self.native.next_episode(i) if seed is None else (seed, 0)
            world = self.task.worlds.world(episode, float(difficulty[i]), {} if options is None else options[i])
            if world:
                worlds[i] = world
        self.native.set_next_worlds(list(worlds), list(worlds.values()))

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
        if self.task.worlds.is_prescribed:
            self._prescribe(np.flatnonzero(mask).tolist())
        self._begin(mask, None, arrays)
        self._previous_action[mask] = 0.0
        buffers.own_reward[mask] = 0.0

    def step(self, actions: ArrayLike, active: Mask) -> tuple[StepBuffers, int]:
        """Moves the active robots on by a control period; returns the results and how many episodes ended."""
        checked = _checks.actions(actions, self._action_shape)
        buffers = self._buffers.take()
        ended = self.native.step(checked, active, buffers.arrays)
        if self._calls_functions:
            ended = self._call_functions(checked, active, buffers)
        return buffers, ended

    def _call_functions(self, action: NDArray[np.float32], active: Mask, buffers: StepBuffers) -> int:
        """Replaces rewards and adds terminations; returns how many episodes have ended."""
        info = {name: values[active] for name, values in buffers.values.items()}
        state = state_of(self.native, self.task.layout, np.flatnonzero(active).tolist(), info)
        arguments = state, action[active], self._previous_action[active]
        arrays = buffers.arrays
        if self._functions.reward is not None:
            reward = _rewards(self._functions.reward(*arguments), active, len(state.time))
            buffers.own_reward.fill(0.0)
            buffers.own_reward[active] = arrays.reward[active] = reward
        if self._functions.termination is not None:
            ends = self._functions.termination(*arguments)
            flags = _result("termination_fn", "flags", ends, len(state.time), "b", "dtype bool")
            arrays.terminated[active] |= flags.astype(np.bool_)
        self._previous_action[active] = action[active]
        return int(np.count_nonzero((arrays.terminated | arrays.truncated) & active))

    def set_difficulty(self, difficulty: ArrayLike, indices: Sequence[int]) -> None:
        """Sets the difficulty of the episodes that the robots begin from now on: one for all, or one each."""
        expected = f"a number, or {len(indices)} of them"
        values = _checks.reals("difficulty", difficulty, expected)
        if values.shape not in [(), (len(indices),)]:
            raise ConfigError("difficulty", repr(difficulty), expected)
        self.native.set_difficulty(indices, np.broadcast_to(values, len(indices)).tolist())

    def push(self, impulse: ArrayLike, indices: Sequence[int]) -> None:
        """Changes the momentum of the links of some robots by impulses (k, L, 2 or 3) or (L, 2 or 3)."""
        links = len(self.task.layout["link_radius"])
        size = 2 if self.task.config["model"] == "planar" else 3
        expected = (len(indices), links, size)
        shapes = f"an array of shape {expected} or {expected[1:]}"
        given = _checks.reals("impulse", impulse, shapes)
        try:
            values = np.broadcast_to(given, expected)
        except ValueError:
            raise ConfigError("impulse", f"shape {given.shape}", shapes) from None
        self.native.push(indices, np.pad(values, [(0, 0), (0, 0), (0, 3 - size)]))

    @property
    def difficulty(self) -> NDArray[np.float64]:
        """The difficulty of the episodes to come (n,)."""
        return np.array(self.native.difficulty())

    def state(self, rows: Sequence[int]) -> State:
        """The state of some robots."""
        return state_of(self.native, self.task.layout, rows)

    def infos(self, buffers: StepBuffers, mask: Mask | None = None) -> dict[str, Any]:
        """Gymnasium's ``infos`` where the robots in ``mask`` report, None: all."""
        infos: dict[str, Any] = buffers.infos() if mask is None else buffers.masked_infos(mask)
        if self._info_state:
            reporting = self.all_rows if mask is None else mask
            infos["state"] = in_infos(self.state(range(self.num_envs)), self._info_state, reporting)
            infos["_state"] = reporting.copy()
        return infos

    def info(self, buffers: StepBuffers) -> dict[str, Any]:
        """The ``info`` of robot 0."""
        info: dict[str, Any] = buffers.numbers()
        if self._info_state:
            state = self.state([0]).robot(0)
            info["state"] = {name: getattr(state, name) for name in self._info_state}
        return info

    def scene(self, i: int) -> Scene:
        """The scene of robot ``i``."""
        return Scene.from_fields(self.native.scene(i))

    def observation(self) -> NDArray[np.float32]:
        """The present observations of all robots."""
        observation = self._buffers.new().arrays.observation
        self.native.observe(self.all_rows, observation)
        return observation

    def get_state(self, i: int, finished: bool) -> RobotState:
        """The state of robot ``i``."""
        return RobotState(self.native.get_state(i), finished, self._previous_action[i].copy(), self.task.config)

    def set_states(self, states: Sequence[RobotState], indices: Sequence[int]) -> None:
        """Replaces the states of some robots, or of none where one of the states does not fit."""
        own = _of_run(self.task.config)
        for k, state in enumerate(states):
            expected = "what get_state of such an environment has returned"
            if not isinstance(state, RobotState) or not isinstance(state.config, Mapping):
                raise ConfigError(f"states[{k}]", type(state).__name__, expected)
            if state.config is not self.task.config and (found := _difference(_of_run(state.config), own)):
                path, theirs, ours = found
                raise ConfigError(f"states[{k}]{path}", repr(theirs), f"{ours!r}, as in this environment")
            if np.shape(state.previous_action) != self._action_shape[1:]:
                raise ConfigError(f"states[{k}].previous_action", f"shape {np.shape(state.previous_action)}", expected)
        self.native.set_states(indices, [state.core for state in states])
        for i, state in zip(indices, states, strict=True):
            self._previous_action[i] = state.previous_action
            self._seeded[i] = True


def _of_run(config: Mapping[str, Any]) -> dict[str, Any]:
    """What a robot's state depends on: neither the time limit, which the classes choose differently, nor the
    obstacles and the difficulty, which the state has.
    """
    rest = {name: value for name, value in config.items() if name not in ("max_episode_steps", "difficulty")}
    return {**rest, "scene": rest.get("scene") and {**rest["scene"], "obstacles": ()}}


def _difference(theirs: Any, ours: Any, path: str = "") -> tuple[str, Any, Any] | None:
    """The first difference of two configurations: its path and both values; None where there is none."""
    if theirs == ours:
        return None
    if isinstance(theirs, Mapping) and isinstance(ours, Mapping):
        inside = (_difference(theirs[name], ours[name], f"{path}.{name}") for name in ours if name in theirs)
        return next(filter(None, inside), (path, theirs, ours))
    return path, theirs, ours


def _rewards(value: Any, active: Mask, rows: int) -> NDArray[np.float64]:
    """The rewards that a function of the user's returned, finite ones."""
    rewards = _result("reward_fn", "rewards", value, rows, "biuf", "real numbers")
    if not np.isfinite(rewards).all():
        k = int(np.argmin(np.isfinite(rewards)))
        robot = int(np.flatnonzero(active)[k])
        raise ConfigError(f"reward_fn[{k}]", rewards[k], f"a finite reward of robot {robot}")
    return rewards.astype(np.float64)


def _result(field: str, what: str, value: Any, rows: int, kinds: str, expected: str) -> NDArray[Any]:
    """What a function of the user's returned, one entry per robot of a dtype of one of these kinds."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise ConfigError(field, f"{what} in rows of different lengths", f"shape {(rows,)}") from None
    if array.shape != (rows,):
        raise ConfigError(field, f"{what} of shape {array.shape}", f"shape {(rows,)}")
    # An empty list, for no robots, is one of float64.
    if rows and array.dtype.kind not in kinds:
        raise ConfigError(field, f"{what} of dtype {array.dtype}", expected)
    return array
