"""What a user may choose about a scripted run: frozen dataclasses, checked by the Rust core.

SI units and radians. A value that is not admissible raises :class:`snake_env.ConfigError` at construction.
"""

from __future__ import annotations

from snake_env.config.controllers import PD, IOLinearizing
from snake_env.config.gait import Gait
from snake_env.config.integrator import Integrator
from snake_env.config.joint_trajectory import JointTrajectory
from snake_env.config.motor import Motor
from snake_env.config.noise import Noise
from snake_env.config.randomization import Randomization
from snake_env.config.robot import PerLink, Robot
from snake_env.config.scene import Patch, Scene, Stribeck
from snake_env.config.start import Start

__all__ = [
    "PD",
    "Gait",
    "IOLinearizing",
    "Integrator",
    "JointTrajectory",
    "Motor",
    "Noise",
    "Patch",
    "PerLink",
    "Randomization",
    "Robot",
    "Scene",
    "Start",
    "Stribeck",
]
