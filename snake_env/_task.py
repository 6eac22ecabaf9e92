"""A configured task: its whole configuration and its description by the core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from snake_env import _checks as checks
from snake_env._native import defaults, layout
from snake_env.config import IOLinearizing, Scene
from snake_env.errors import ConfigError
from snake_env.options import TaskOptions

NO_STEP_LIMIT = 2**32 - 1

SINGLE_KEYWORDS = ["max_episode_steps", "render_mode", "reward_fn"]
"""Keywords that the class of one environment takes itself."""
BATCH_KEYWORDS = ["num_envs", "max_episode_steps", "render_mode", "autoreset_mode", "num_threads", "reward_fn"]
"""Keywords that the class of a batch takes itself."""


class Task:
    """What an environment is made from.

    Args:
        options: see :class:`snake_env.options.TaskOptions`.
        max_episode_steps: None for no limit.
        keywords: those that the environment's class takes itself, for the message about one that it does not.

    Attributes:
        layout: description by the core: "observation", "action" and "signals" entry by entry, "control_period" [s],
            and "config".
        config: the whole configuration with its defaults.
        observation_space: of one robot.
        action_space: of one robot.
    """

    def __init__(
        self,
        options: Mapping[str, Any],
        max_episode_steps: int | None,
        keywords: Sequence[str] = SINGLE_KEYWORDS,
    ) -> None:
        _require_known(options, keywords)
        limit = NO_STEP_LIMIT if max_episode_steps is None else max_episode_steps
        self.layout: dict[str, Any] = layout({**options, **_controller(options), "max_episode_steps": limit})
        self.config: dict[str, Any] = self.layout["config"]
        self.control_period: float = self.layout["control_period"]
        low, high = _bounds(self.layout["observation"])
        self.observation_space = Box(low, high, dtype=np.float32)
        self.action_space = Box(-1.0, 1.0, (len(self.layout["action"]),), dtype=np.float32)


RATES_PER_PERIOD = 10
""""io" takes its gains from this part of the control period: critically damped, and soft enough for pegs."""


def _controller(options: Mapping[str, Any]) -> dict[str, Any]:
    """The option "controller" as the core has it, if it is given by name."""
    value = options.get("controller")
    if not isinstance(value, str):
        return {}
    checks.choice("controller", value, ["pd", "io"])
    environment = defaults("environment")
    if value == "pd":
        return {"controller": environment["controller"]}
    period = options.get("control_period", environment["control_period"])
    return {"controller": _io(period, environment["controller"]["torque_limit"])}


def _io(control_period: Any, torque_limit: float) -> IOLinearizing:
    try:
        period = float(control_period) / RATES_PER_PERIOD
    except (TypeError, ValueError):
        raise ConfigError("control_period", repr(control_period), "a finite number") from None
    return IOLinearizing.for_period(period, torque_limit=torque_limit, treatment="implicit")


NO_SCENE = (
    "no scene: the pegs of an environment come from its task (keywords task, field, difficulty, push_points and "
    "perturbation), its ground from friction and stribeck; a Scene goes to snake_env.simulate"
)


def _require_known(options: Mapping[str, Any], keywords: Sequence[str]) -> None:
    """A keyword that the environment does not have gets an error that says where it belongs, or the nearest one."""
    known = [*TaskOptions.__annotations__, *keywords]
    for name, value in options.items():
        if name == "scene":
            raise ConfigError(name, "Scene(...)" if isinstance(value, Scene) else repr(value), NO_SCENE)
        if name not in TaskOptions.__annotations__:
            raise ConfigError(name, value, f"{_instead_of(name, known)}; known are {', '.join(known)}")


def _instead_of(name: str, known: Sequence[str]) -> str:
    if name in BATCH_KEYWORDS:
        return f"a keyword of one environment; {name} belongs to batches, gymnasium.make_vec"
    near = get_close_matches(name, known, 1, 0.5)
    return f"a known keyword, perhaps {near[0]}" if near else "a known keyword"


def _bounds(blocks: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bound of each observation element."""
    sizes = [block["size"] for block in blocks]
    low = np.repeat([block["low"] for block in blocks], sizes)
    high = np.repeat([block["high"] for block in blocks], sizes)
    return low.astype(np.float32), high.astype(np.float32)
