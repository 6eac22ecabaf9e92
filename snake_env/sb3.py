"""Stable-Baselines3's ``VecEnv`` over the native batch."""

from __future__ import annotations

import marshal
import time
from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env._robot_view import RobotView, row_of
from snake_env.errors import ConfigError
from snake_env.vector_env import SnakeVectorEnv, refuse_other_autoreset, refuse_others

with extras():
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv, VecMonitor
    from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn


def make(
    env_id: str = "SnakeField-v1",
    num_envs: int = 1,
    *,
    monitor: bool = True,
    seed: int | None = None,
    **options: Any,
) -> SnakeVecEnv:
    """A native batch as a Stable-Baselines3 ``VecEnv``.

    Args:
        env_id: a registered id of this package.
        num_envs: number of robots.
        monitor: report ``episode`` = {"r", "l", "t"} in the info of an episode's last step, as ``VecMonitor`` would.
        seed: robot ``i`` takes ``seed + i`` in the first reset; None: whatever comes.
        **options: keywords of :class:`snake_env.SnakeVectorEnv`.

    Raises:
        ConfigError: the id is another package's, or an option is not admissible.
    """
    refuse_others(env_id)
    options.setdefault("autoreset_mode", "SameStep")
    made = SnakeVecEnv(gym.make_vec(env_id, num_envs=num_envs, **options), monitor=monitor)  # type: ignore[arg-type]
    made.seed(seed)
    return made


def native(venv: VecEnv, env_id: str = "SnakeField-v1", seed: int | None = None, **options: Any) -> VecMonitor:
    """RL Zoo's ``vec_env_wrapper`` hook: puts the native batch in the place of the Zoo's environments.

    The Zoo's keywords and seed go to the environments that are thrown away: give them here,
    ``vec_env_wrapper: {snake_env.sb3.native: {env_id: SnakeField-v1, seed: 0}}``.
    """
    num_envs = venv.num_envs
    render_mode = venv.render_mode
    venv.close()
    return VecMonitor(make(env_id, num_envs, monitor=False, seed=seed, render_mode=render_mode, **options))


class SnakeVecEnv(VecEnv):
    """Stable-Baselines3's view of a :class:`snake_env.SnakeVectorEnv` in SameStep mode.

    ``infos[i]`` is empty but for the last step of an episode, which has ``terminal_observation``,
    ``TimeLimit.truncated``, all signals of the environment's info and, with ``monitor``, ``episode``. The signals of
    every step are in ``signals``.

    Args:
        env: the batch, in SameStep mode.
        monitor: report ``episode``.
    """

    def __init__(self, env: SnakeVectorEnv, monitor: bool = True) -> None:
        refuse_other_autoreset(env, "Stable-Baselines3")
        self.env = env
        self.spec = env.spec
        self.monitor = monitor
        self._infos: dict[str, Any] = {}
        self._return = np.zeros(env.num_envs)
        # New mappings in each step, of which loading makes 256 in 7.6 us and a comprehension in 9 us.
        self._empty_infos = marshal.dumps([{} for _ in range(env.num_envs)])
        self._steps = 0
        self._steps_before = np.zeros(env.num_envs, np.int64)
        self._start_time = time.time()
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self.metadata = env.metadata

    def reset(self) -> NDArray[np.float32]:
        """Starts new episodes with the seeds and options set since the last reset."""
        observation = self._reset(self._seeds, _together(self._options))
        self._reset_seeds()
        self._reset_options()
        return observation

    def _reset(self, seeds: Sequence[int | None], options: dict[str, Any]) -> NDArray[np.float32]:
        """Starts new episodes of the robots that the options name; the others keep return and length."""
        observation, self._infos = self.env.reset(seed=seeds, options=options)
        fresh = self._infos["_time"]
        self.clear_running_totals(fresh)
        for i in np.flatnonzero(fresh).tolist():
            self.reset_infos[i] = _row(self._infos, i)
        return observation

    def clear_running_totals(self, mask: NDArray[np.bool_]) -> None:
        """Return and length of the episodes of the robots in ``mask`` count from zero."""
        self._return[mask] = 0.0
        self._steps_before[mask] = self._steps

    def step_async(self, actions: NDArray[Any]) -> None:
        """Takes the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Takes the step."""
        observation, reward, terminated, truncated, infos = self.env.step(self._actions)
        self._return += reward
        self._steps += 1
        rows: list[dict[str, Any]] = marshal.loads(self._empty_infos)
        if "final_obs" in infos:
            for i in np.flatnonzero(infos["_final_obs"]).tolist():
                rows[i] = self._last_info(i, infos, bool(truncated[i] and not terminated[i]))
                self.reset_infos[i] = _row(infos, i)
        self._infos = infos
        return observation, reward.astype(np.float32), terminated | truncated, rows

    def _last_info(self, i: int, infos: dict[str, Any], truncated: bool) -> dict[str, Any]:
        """The info of the last step of an episode."""
        info = _row(infos["final_info"], i)
        info["terminal_observation"] = infos["final_obs"][i]
        info["TimeLimit.truncated"] = truncated
        if self.monitor:
            length, elapsed = self._steps - int(self._steps_before[i]), round(time.time() - self._start_time, 6)
            info["episode"] = {"r": round(float(self._return[i]), 6), "l": length, "t": elapsed}
        self._return[i] = 0.0
        self._steps_before[i] = self._steps
        return info

    @property
    def running_totals(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return and length (n,) of the episodes that run; set them to continue from states taken before."""
        return self._return.copy(), self._steps - self._steps_before

    @running_totals.setter
    def running_totals(self, value: tuple[NDArray[np.float64], NDArray[np.int64]]) -> None:
        self._return[:], length = value
        self._steps_before[:] = self._steps - length

    @property
    def signals(self) -> dict[str, NDArray[Any]]:
        """The signals of all robots in the last step or reset, by name."""
        return _signals(self._infos)

    def close(self) -> None:
        """Closes the batch."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The attribute, once for each robot."""
        return [getattr(robot, attr_name) for robot in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Sets ``difficulty`` of some robots, or another attribute, which the robots share, of all of them."""
        robots = self._chosen(indices)
        if attr_name == "difficulty":
            self.env.set_difficulty(value, np.isin(np.arange(self.num_envs), [robot.index for robot in robots]))
            return
        if len(robots) != self.num_envs:
            raise ConfigError("indices", indices, "None: the robots of a native batch share their attributes")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Calls a method robot by robot.

        Raises:
            ConfigError: it is a method of the batch, such as ``step``; call it on ``env``.
        """
        return [robot.call(method_name, *method_args, **method_kwargs) for robot in self._chosen(indices)]

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper], indices: VecEnvIndices = None) -> list[bool]:
        """True for ``Monitor`` if episodes are reported; no robot has other wrappers."""
        return [self.monitor and wrapper_class is Monitor] * len(self._chosen(indices))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """The images of all robots; None each without ``render_mode="rgb_array"``."""
        return self.env.render() or [None] * self.num_envs

    def _chosen(self, indices: VecEnvIndices) -> list[_Robot]:
        chosen: Iterable[int] = self._get_indices(indices)
        return [_Robot(self, i) for i in chosen]


class _Robot(RobotView):
    """One robot of a batch, whose running totals a reset clears."""

    def __init__(self, venv: SnakeVecEnv, index: int) -> None:
        super().__init__(venv.env, index)
        self._venv = venv

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = super().reset(seed=seed, options=options)
        self._venv.clear_running_totals(self._mask)
        self._venv.reset_infos[self.index] = info
        return observation, info


def _together(options: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Options of the batch: those that all robots share, or each robot's own in lists."""
    if all(one is options[0] for one in options):
        return options[0]
    names = dict.fromkeys(name for one in options for name in one)
    return {name: [one.get(name) for one in options] for name in names}


def _row(infos: dict[str, Any], i: int) -> dict[str, Any]:
    """The info of robot ``i`` as Python numbers, and arrays of its state."""
    return row_of(_signals(infos), i)


def _signals(infos: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """The infos without masks and without what belongs to finished episodes."""
    return {name: values for name, values in infos.items() if not name.startswith(("_", "final_"))}
