"""A configured task: its whole configuration and its description by the core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Space
from numpy.typing import NDArray

from snake_env import _checks as checks
from snake_env import _worlds, robot_classes
from snake_env._native import defaults, layout
from snake_env.config import Integrator, IOLinearizing
from snake_env.errors import ConfigError
from snake_env.options import TaskOptions

NO_STEP_LIMIT = 2**32 - 1

SINGLE_KEYWORDS = [
    "max_episode_steps",
    "render_mode",
    "reward_fn",
    "termination_fn",
    "observation",
    "info_state",
    "picture",
]
"""Keywords that the class of one environment takes itself."""
BATCH_KEYWORDS = [*SINGLE_KEYWORDS, "num_envs", "autoreset_mode", "num_threads"]
"""Keywords that the class of a batch takes itself."""


class Task:
    """What an environment is made from.

    Args:
        options: see :class:`snake_env.options.TaskOptions`.
        max_episode_steps: None for no limit.
        observation: "flat", one array, or "dict", an array for each block.
        keywords: those that the environment's class takes itself, for the message about one that it does not.

    Attributes:
        worlds: where episodes take place.
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
        observation: str = "flat",
    ) -> None:
        _require_known(options, keywords)
        options, class_noise = robot_classes.split(options)
        self.worlds, options = _worlds.split(options)
        limit = NO_STEP_LIMIT if max_episode_steps is None else max_episode_steps
        options = dict(options)
        if (precision := options.pop("precision", None)) is not None:
            options["integrator"] = Integrator.at(precision, options.get("integrator"))
        core = {**options, **_controller(options), "max_episode_steps": limit}
        if class_noise:
            seen = [block["name"] for block in layout(core)["observation"]]
            of_seen = {name: amplitude for name, amplitude in class_noise.items() if name in seen}
            core["observation_noise"] = {**of_seen, **options.get("observation_noise", {})}
        self.layout: dict[str, Any] = layout(core)
        self.config: dict[str, Any] = self.layout["config"]
        self.control_period: float = self.layout["control_period"]
        blocks = self.layout["observation"]
        low, high = _bounds(blocks)
        self.observation_size = len(low)
        self._blocks = {block["name"]: slice(block["start"], block["start"] + block["size"]) for block in blocks}
        self._is_dict = checks.choice("observation", observation, ["flat", "dict"]) == "dict"
        self.observation_space: Space[Any] = (
            Dict({name: Box(low[part], high[part], dtype=np.float32) for name, part in self._blocks.items()})
            if self._is_dict
            else Box(low, high, dtype=np.float32)
        )
        self.action_space = Box(-1.0, 1.0, (len(self.layout["action"]),), dtype=np.float32)

    def observed(self, observation: NDArray[np.float32]) -> Any:
        """Flat observations (..., o) as the observation space has them; the arrays of blocks are views."""
        if not self._is_dict:
            return observation
        return {name: observation[..., part] for name, part in self._blocks.items()}


RATES_PER_PERIOD = 10
""""io" takes its gains from this part of the control period: critically damped, and soft enough for pegs."""


def _controller(options: Mapping[str, Any]) -> dict[str, Any]:
    """The option "controller" as the core has it, if it is given by name."""
    value = options.get("controller")
    if not isinstance(value, str):
        return {}
    checks.choice("controller", value, ["pd", "io"])
    controller = defaults("environment")["controller"]
    if value == "pd":
        return {"controller": controller}
    # The core checks the period before gains follow from it.
    given = {name: options[name] for name in ("control_period",) if name in options}
    period = layout(given)["config"]["control_period"] / RATES_PER_PERIOD
    limit = controller["torque_limit"]
    return {"controller": IOLinearizing.for_period(period, torque_limit=limit, treatment="implicit")}


def _require_known(options: Mapping[str, Any], keywords: Sequence[str]) -> None:
    """A keyword that the environment does not have gets an error that says where it belongs, or the nearest one."""
    known = [*TaskOptions.__annotations__, *keywords]
    for name, value in options.items():
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
