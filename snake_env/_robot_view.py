"""One robot of a batch, for interfaces that address robots one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env._robots import RobotState
from snake_env.config import Scene
from snake_env.errors import ConfigError
from snake_env.state import State

if TYPE_CHECKING:
    from snake_env.vector_env import SnakeVectorEnv

METHODS = ("reset", "render", "state", "scene", "set_difficulty", "push", "get_state", "set_state")
"""What can be called robot by robot."""


class RobotView:
    """A robot with the attributes of its batch, and with methods that act on it and no other."""

    def __init__(self, env: SnakeVectorEnv, index: int) -> None:
        self.index = index
        self._env = env
        self._mask = np.arange(env.num_envs) == index
        self.observation_space = env.single_observation_space
        self.action_space = env.single_action_space

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or "_env" not in self.__dict__:
            raise AttributeError(name)
        return getattr(self._env, name)

    def call(self, name: str, *args: Any, **kwargs: Any) -> Any:
        """Calls a method.

        Raises:
            ConfigError: it is a method of the batch, such as ``step``.
        """
        if name not in METHODS and hasattr(type(self._env), name):
            raise ConfigError("method_name", name, f"one of {', '.join(METHODS)}; others belong to the batch")
        return getattr(self, name)(*args, **kwargs)

    @property
    def unwrapped(self) -> RobotView:
        return self

    @property
    def difficulty(self) -> float:
        return float(self._env.difficulty[self.index])

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        seeds = [seed if one else None for one in self._mask]
        observation, infos = self._env.reset(seed=seeds, options={**(options or {}), "reset_mask": self._mask})
        return _row(observation, self.index), row_of(infos, self.index)

    def render(self) -> NDArray[np.uint8] | None:
        return self._env.render_robot(self.index)

    def state(self) -> State:
        return self._env.state().robot(self.index)

    def scene(self) -> Scene:
        return self._env.scene(self.index)

    def set_difficulty(self, difficulty: float) -> None:
        self._env.set_difficulty(difficulty, self._mask)

    def push(self, impulse: ArrayLike) -> None:
        self._env.push(impulse, self._mask)

    def get_state(self) -> RobotState:
        return self._env.get_state(self._mask)[0]

    def set_state(self, state: RobotState) -> Any:
        return _row(self._env.set_state([state], self._mask), self.index)


def row_of(infos: dict[str, Any], i: int) -> dict[str, Any]:
    """The info of one robot."""
    row: dict[str, Any] = {}
    for name, values in infos.items():
        if name == "state":
            row[name] = {quantity: array[i] for quantity, array in values.items() if not quantity.startswith("_")}
        elif not name.startswith("_"):
            row[name] = values[i].item()
    return row


def _row(observation: Any, i: int) -> Any:
    """The observation of one robot, an array or a mapping of arrays."""
    if isinstance(observation, dict):
        return {name: values[i] for name, values in observation.items()}
    return observation[i]
