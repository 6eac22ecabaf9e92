"""Wheel-less snake robots, batched, with exact Coulomb friction and obstacle contact.

Importing the package registers the environments with Gymnasium, SnakeField-v0 among them; see docs/environments.md.
"""

from __future__ import annotations

try:
    from snake_env._native import __version__
except ImportError as error:
    raise ImportError("snake_env's compiled core cannot be loaded: run `make build` in the repository") from error

from snake_env import minimal
from snake_env.config import PD, Gait, Integrator, IOLinearizing, Noise, Randomization, Robot, Scene, Start, Stribeck
from snake_env.env import SnakeEnv
from snake_env.errors import ConfigError, DivergenceError, InternalError
from snake_env.registration import register
from snake_env.simulation import simulate
from snake_env.trajectory import Trajectory
from snake_env.vector_env import SnakeVectorEnv

__all__ = [
    "PD",
    "ConfigError",
    "DivergenceError",
    "Gait",
    "IOLinearizing",
    "Integrator",
    "InternalError",
    "Noise",
    "Randomization",
    "Robot",
    "Scene",
    "SnakeEnv",
    "SnakeVectorEnv",
    "Start",
    "Stribeck",
    "Trajectory",
    "__version__",
    "minimal",
    "simulate",
]

register()
