"""One scripted robot, simulated from a configuration to a trajectory."""

from __future__ import annotations

import dataclasses
import math
import warnings
from typing import Any

import numpy as np

from snake_env import _native
from snake_env._checks import choice
from snake_env._encode import encode
from snake_env.config import PD, Gait, Integrator, IOLinearizing, Noise, Robot, Scene, Start
from snake_env.errors import ConfigError
from snake_env.minimal import TABLE_7_2_GROUND, TABLE_7_2_PD
from snake_env.trajectory import Trajectory

VISIBLE_PENETRATION = 1e-3
"""Overlap of a link and a peg or the ground that no step of usual length leaves [m]."""


def simulate(
    model: str = "planar",
    robot: Robot | None = None,
    scene: Scene | None = None,
    gait: Gait | None = None,
    controller: PD | IOLinearizing | None = None,
    integrator: Integrator | None = None,
    start: Start | None = None,
    duration: float = 5.0,
    sample: float = 0.1,
    noise: Noise | None = None,
    seed: int = 0,
    friction_law: str | None = None,
    viscous: tuple[float, float] | None = None,
) -> Trajectory:
    """Simulate one robot that follows a gait.

    Args:
        model: "planar", the model of chapter 3; "spatial", the 3D model of chapter 4; "minimal", the robot
            model of chapter 6 in minimal coordinates.
        robot: default :class:`Robot`, Aiko.
        scene: default :class:`Scene`, flat ground with isotropic friction; for "minimal" the ground of (T Table 7.2).
        gait: default lateral undulation.
        controller: default :class:`PD`, for "minimal" with the gains of (T Table 7.2).
        integrator: default :class:`Integrator`, that of the environments.
        start: default the start of a preset course, otherwise :class:`Start`.
        duration: simulated time [s], > 0.
        sample: interval between samples [s], > 0; the last sample is at the last multiple not after ``duration``.
        noise: noise on the measurements of the controller, "minimal" alone; None for none.
        seed: seed of the noise.
        friction_law: instead of the scene's.
        viscous: instead of the scene's.

    Raises:
        ConfigError: names the field, the value and what is admissible.

    Warns:
        UserWarning: a link overlapped a peg, or in the spatial model the ground, by more than a millimetre, as when the
            robot starts inside one; or solves gave up before their tolerance.
    """
    choice("model", model, ("planar", "spatial", "minimal"))
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError("seed", repr(seed), "an integer >= 0")
    scene = _scene(model, scene, friction_law, viscous)
    if start is None:
        on_course = "spatial" if model == "spatial" else "planar"
        start = Start() if scene.course is None else Start.on_course(scene, on_course)
    config: dict[str, Any] = {
        "robot": _section("robot", robot, Robot)._for_core(),
        "gait": _gait(model, gait)._for_core(),
        "integrator": _section("integrator", integrator, Integrator)._for_core(),
        "start": _section("start", start, Start),
        "duration": duration,
        "sample": sample,
    }
    run = {"planar": _planar, "spatial": _spatial, "minimal": _minimal}[model]
    trajectory = run(config, scene, controller, noise, seed)
    _warn_of_penetration(trajectory, "a peg or the ground" if model == "spatial" else "a peg")
    _warn_of_misses(trajectory)
    return trajectory


def _gait(model: str, gait: Gait | None) -> Gait:
    """An offset that leaves no room for any amplitude is named itself; the core names the amplitude."""
    gait = _section("gait", gait, Gait)
    offset = abs(gait.gamma)
    if model == "spatial" and offset >= math.pi / 2:
        raise ConfigError("gait.gamma", gait.gamma, "an angle in (-pi/2, pi/2), in radians")
    if offset > math.pi:
        raise ConfigError("gait.gamma", gait.gamma, "an angle in [-pi, pi], in radians")
    return gait


def _planar(config: dict[str, Any], scene: Scene, controller: Any, noise: Any, seed: int) -> Trajectory:
    if not isinstance(controller, IOLinearizing):
        controller = _section("controller", controller, PD)
    config["start"] = config["start"]._for_plane()
    return Trajectory(**_native.simulate(_among_pegs(config, scene, controller, noise)))


def _spatial(config: dict[str, Any], scene: Scene, controller: Any, noise: Any, seed: int) -> Trajectory:
    controller = _section("controller", controller, PD)
    return Trajectory(**_native.simulate_spatial(_among_pegs(config, scene, controller, noise)))


def _among_pegs(config: dict[str, Any], scene: Scene, controller: PD | IOLinearizing, noise: Any) -> str:
    if noise is not None:
        raise ConfigError("noise", noise, 'None, or model="minimal"')
    return encode({**config, "scene": scene._for_planar(), "controller": controller._for_planar()})


def _minimal(config: dict[str, Any], scene: Scene, controller: Any, noise: Any, seed: int) -> Trajectory:
    if scene.obstacles:
        raise ConfigError("scene.obstacles", f"{len(scene.obstacles)} pegs", 'none: the model "minimal" has no pegs')
    if scene.stribeck.drop:
        raise ConfigError("scene.stribeck.drop", scene.stribeck.drop, '0, or model="planar"')
    if controller is None:
        controller = TABLE_7_2_PD
    if not isinstance(controller, IOLinearizing):
        controller = _section("controller", controller, PD)
    config["start"] = config["start"]._for_plane()
    config["scene"] = scene._ground()
    config["controller"] = controller._feedback()
    config["noise"] = _section("noise", noise, Noise)._for_core()
    config["seed"] = seed
    return Trajectory(**_native.simulate_minimal(encode(config)))


def _warn_of_penetration(trajectory: Trajectory, where: str) -> None:
    """One that no step of usual length leaves."""
    if trajectory.max_penetration > VISIBLE_PENETRATION:
        depth = f"{trajectory.max_penetration:.2g} m"
        warnings.warn(f"a link and {where} overlapped by {depth}: does the robot start inside {where}?", stacklevel=3)


def _warn_of_misses(trajectory: Trajectory) -> None:
    """Solves without a certificate."""
    misses = trajectory.misses.sum()
    if misses:
        first = trajectory.time[np.argmax(trajectory.misses > 0)]
        warnings.warn(
            f"{misses:.0f} solves gave up before their tolerance, the first by t = {first:g} s, with residuals up to "
            f"{trajectory.residual.max():.1g} m/s (Trajectory.misses, Trajectory.residual): take a smaller "
            "Integrator.step or a larger Integrator.max_iterations",
            stacklevel=3,
        )


def _scene(model: str, scene: Scene | None, friction_law: str | None, viscous: tuple[float, float] | None) -> Scene:
    if scene is None and model == "minimal":
        scene = TABLE_7_2_GROUND
    scene = _section("scene", scene, Scene)
    changes = {"friction_law": friction_law, "viscous": viscous}
    changes = {name: value for name, value in changes.items() if value is not None}
    return dataclasses.replace(scene, **changes)


def _section(name: str, value: Any, kind: type) -> Any:
    """The value, or the default of its kind."""
    if value is None:
        return kind()
    if not isinstance(value, kind):
        raise ConfigError(name, repr(value), f"a snake_env.{kind.__name__}")
    return value
