"""One scripted robot, simulated from a configuration to a trajectory."""

from __future__ import annotations

import warnings
from typing import Any

from snake_env import _native
from snake_env._encode import encode
from snake_env.config import PD, Gait, Integrator, Robot, Scene, Start
from snake_env.errors import ConfigError
from snake_env.trajectory import Trajectory

VISIBLE_PENETRATION = 1e-3
"""Overlap of a link and a peg that no step of usual length leaves [m]."""


def simulate(
    model: str = "planar",
    robot: Robot | None = None,
    scene: Scene | None = None,
    gait: Gait | None = None,
    controller: PD | None = None,
    integrator: Integrator | None = None,
    start: Start | None = None,
    duration: float = 5.0,
    sample: float = 0.1,
    noise: None = None,
    seed: int = 0,
) -> Trajectory:
    """Simulate one robot that follows a gait.

    Args:
        model: "planar", the model of chapter 3.
        robot: default :class:`Robot`, Aiko.
        scene: default :class:`Scene`, flat ground with isotropic friction.
        gait: default lateral undulation.
        controller: default :class:`PD`.
        integrator: default :class:`Integrator`, that of the environments.
        start: default the start of a preset course, otherwise :class:`Start`.
        duration: simulated time [s], > 0.
        sample: interval between samples [s], > 0; the last sample is at the last multiple not after ``duration``.
        noise: None; measurement noise needs the model of chapter 6.
        seed: seed of the noise.

    Raises:
        ConfigError: names the field, the value and what is admissible.

    Warns:
        UserWarning: a link overlapped a peg by more than a millimetre, as when the robot starts inside one.
    """
    if noise is not None:
        raise ConfigError("noise", noise, "None: this release has no measurement noise")
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError("seed", repr(seed), "an integer >= 0")
    scene = _section("scene", scene, Scene)
    if start is None:
        start = Start() if scene.course is None else Start.on_course(scene)
    config: dict[str, Any] = {
        "model": model,
        "robot": _section("robot", robot, Robot)._for_core(),
        "scene": scene._for_core(),
        "gait": _section("gait", gait, Gait)._for_core(),
        "controller": _section("controller", controller, PD)._for_core(),
        "integrator": _section("integrator", integrator, Integrator)._for_core(),
        "start": _section("start", start, Start),
        "duration": duration,
        "sample": sample,
    }
    trajectory = Trajectory(**_native.simulate(encode(config)))
    if trajectory.max_penetration > VISIBLE_PENETRATION:
        depth = f"{trajectory.max_penetration:.2g} m"
        warnings.warn(f"a link and a peg overlapped by {depth}: does the robot start inside a peg?", stacklevel=2)
    return trajectory


def _section(name: str, value: Any, kind: type) -> Any:
    """The value, or the default of its kind."""
    if value is None:
        return kind()
    if not isinstance(value, kind):
        raise ConfigError(name, repr(value), f"a snake_env.{kind.__name__}")
    return value
