"""Wheel-less snake robots, batched, with exact Coulomb friction and obstacle contact.

Importing the package registers the environments with Gymnasium, SnakeField-v1 among them; see docs/environments.md.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

try:
    from snake_env._native import __version__
except ImportError as error:
    raise ImportError(
        f"the compiled core of snake_env cannot be loaded ({error}): reinstall snake-robot-env for this Python and "
        "platform; in a clone of the repository, whose folder hides an installed package, run `make build`"
    ) from error

from snake_env import minimal, obstacles, rewards
from snake_env._native import lanes as _lanes
from snake_env.batch import Batch
from snake_env.config import (
    PD,
    Gait,
    Integrator,
    IOLinearizing,
    JointTrajectory,
    Motor,
    Noise,
    Patch,
    Randomization,
    Robot,
    Scene,
    Start,
    Stribeck,
)
from snake_env.env import SnakeEnv
from snake_env.errors import ConfigError, DivergenceError, InternalError
from snake_env.picture import Picture
from snake_env.registration import register
from snake_env.simulation import simulate
from snake_env.state import State
from snake_env.trajectory import Trajectory, load_trajectory
from snake_env.vector_env import SnakeVectorEnv

if TYPE_CHECKING:
    from snake_env.evaluation.film import film
    from snake_env.evaluation.protocol import evaluate
    from snake_env.policies.loading import load_policy
    from snake_env.viewer.live import view

LAZY_MODULES = ("sb3", "rsl_rl", "rllib", "testing", "zoo", "policies", "evaluation")
"""Modules that ``import snake_env`` leaves out, since they import others; they are loaded when they are first named."""

LAZY_NAMES = {
    "load_policy": "snake_env.policies.loading",
    "evaluate": "snake_env.evaluation.protocol",
    "film": "snake_env.evaluation.film",
    "view": "snake_env.viewer.live",
}
"""Functions in such modules."""


def __getattr__(name: str) -> Any:
    if name in LAZY_NAMES:
        return getattr(import_module(LAZY_NAMES[name]), name)
    if name not in LAZY_MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")


__all__ = [
    "PD",
    "Batch",
    "ConfigError",
    "DivergenceError",
    "Gait",
    "IOLinearizing",
    "Integrator",
    "InternalError",
    "JointTrajectory",
    "Motor",
    "Noise",
    "Patch",
    "Picture",
    "Randomization",
    "Robot",
    "Scene",
    "SnakeEnv",
    "SnakeVectorEnv",
    "Start",
    "State",
    "Stribeck",
    "Trajectory",
    "__version__",
    "evaluate",
    "film",
    "load_policy",
    "load_trajectory",
    "minimal",
    "obstacles",
    "rewards",
    "simulate",
    "view",
]

_lanes()  # refuses a width of registers that the processor lacks
register()
