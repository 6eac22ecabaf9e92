"""One scripted robot, simulated from a configuration to a trajectory."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from snake_env import _checks, minimal
from snake_env._native import simulate as native_simulate
from snake_env.config import PD, Gait, Integrator, IOLinearizing, JointTrajectory, Noise, Robot, Scene, Start
from snake_env.config.joint_trajectory import JointReference
from snake_env.errors import ConfigError
from snake_env.trajectory import Trajectory

MODELS = ("planar", "spatial", "minimal")

VISIBLE_PENETRATION = 1e-3
"""Penetration above which :func:`simulate` warns [m]."""


def simulate(
    model: str = "planar",
    robot: Robot | Mapping[str, Any] | None = None,
    scene: Scene | Mapping[str, Any] | None = None,
    gait: Gait | JointTrajectory | JointReference | None = None,
    controller: PD | IOLinearizing | None = None,
    integrator: Integrator | None = None,
    start: Start | None = None,
    duration: float = 5.0,
    sample: float = 0.1,
    noise: Noise | None = None,
    seed: int = 0,
    self_contact: bool | None = None,
    reference_rate: float | None = None,
    reference_delay: float = 0.0,
    record: str | Sequence[str] = (),
    precision: str | None = None,
) -> Trajectory:
    """Simulate one robot that follows a gait.

    Args:
        model: "planar", the model of chapter 3; "spatial", the 3D model of chapter 4; "minimal", the robot
            model of chapter 6 in minimal coordinates.
        robot: default :class:`Robot`, Aiko.
        scene: default :class:`Scene`, flat ground with isotropic friction; for "minimal" the ground of (T Table 7.2).
        gait: default lateral undulation; also a :class:`JointTrajectory`, or an object whose ``angle(time)`` and
            ``rate(time)`` return the references of all joints, sampled every 5 ms.
        controller: default :class:`PD`, for "minimal" with the gains of (T Table 7.2).
        integrator: default :class:`Integrator`, that of the environments.
        start: default the start of a preset course, otherwise :class:`Start`.
        duration: simulated time [s], > 0.
        sample: interval between samples [s], > 0; the last sample is at the last multiple not after ``duration``.
        noise: noise on the measurements of the controller, "minimal" only; None for none.
        seed: seed of the noise.
        self_contact: whether links that are not neighbours touch each other; None: as ``robot.self_contact``, which is
            True by default where the model and its method have it.
        reference_rate: how often the joints receive a sample of the reference [Hz], 0.1 to 10000: cubics lead from one
            to the next; None: all the time.
        reference_delay: time from a reference to its arrival at the joints [s], 0 to 10.
        record: what the trajectory holds besides the motion, one name or several of "velocity", "ground", "obstacles",
            "self_contacts" and "power": the optional arrays of :class:`Trajectory`. The minimal model has no
            obstacles and no contact with itself, and sums forces and power up with set-valued friction only.
        precision: "fast", "default" or "fine": how accurate the time stepping is; the fields of ``integrator`` override
            it.

    Raises:
        ConfigError: names the field, the value and what is admissible.
        DivergenceError: the state became NaN, infinite or implausibly fast.

    Warns:
        UserWarning: a link overlapped a peg, or in the spatial model the ground, by more than a millimetre. Or solves
            ended before their tolerance. Or all samples of a :class:`JointTrajectory` lie before the run or after it.
    """
    _checks.choice("model", model, MODELS)
    of_run: dict[str, Any] = {"robot": _robot(robot, self_contact), "scene": _scene(model, scene)}
    delay = _checks.number("reference_delay", reference_delay, 0.0, 10.0)
    if gait is None or isinstance(gait, Mapping):
        gait = Gait.of(gait)
    own = gait
    if reference_rate is not None or delay != 0.0 or not _is_section(gait):
        chain = of_run["robot"]
        with_axes = chain if model == "spatial" and chain.axes != "both" else None
        gait = JointTrajectory.sampled(gait, duration, chain.links - 1, reference_rate, delay, with_axes)
    config = {"model": model, "duration": duration, "sample": sample, "seed": seed, "record": _groups(record)}
    sections = {
        **of_run,
        "gait": None if isinstance(gait, JointTrajectory) else gait,
        "joint_trajectory": gait.fields() if isinstance(gait, JointTrajectory) else None,
        "controller": controller,
        "integrator": integrator if precision is None else Integrator.at(precision, integrator),
        "start": _start(model, of_run["scene"]) if start is None else start,
        "noise": noise,
    }
    given = {name: section for name, section in sections.items() if section is not None}
    trajectory = Trajectory(**_native_run(config | given), **of_run)
    _warn_of_penetration(trajectory, _others(model, trajectory))
    _warn_of_unconverged(trajectory)
    if isinstance(own, JointTrajectory):
        _warn_of_samples(own, duration)
    return trajectory


def _robot(given: Any, self_contact: Any) -> Robot:
    robot = Robot.of(given)
    return robot if self_contact is None else dataclasses.replace(robot, self_contact=self_contact)


def _scene(model: str, given: Any) -> Scene:
    return minimal.TABLE_7_2_GROUND if given is None and model == "minimal" else Scene.of(given)


def _is_section(gait: Any) -> bool:
    """Whether the core reads the gait as it is, or refuses it by name."""
    return isinstance(gait, Gait | JointTrajectory) or not hasattr(gait, "angle")


def _groups(record: Any) -> list[Any]:
    """Names of what is recorded, each once; the core checks them."""
    if isinstance(record, str):
        return [record]
    try:
        return list(dict.fromkeys(record))
    except TypeError:
        raise ConfigError("record", repr(record), "a name or a list of names") from None


def _native_run(config: dict[str, Any]) -> dict[str, Any]:
    """The arrays of a run."""
    try:
        return native_simulate(config)
    except ConfigError as error:
        # The core shows the noise in its own notation.
        if error.field == "noise":
            raise ConfigError("noise", repr(config["noise"]), error.expected) from None
        raise


def _start(model: str, scene: Scene) -> Start | None:
    """The start of a preset course."""
    if scene.course is None:
        return None
    return Start.on_course(scene, "spatial" if model == "spatial" else "planar")


def _others(model: str, trajectory: Trajectory) -> str:
    """What a link may penetrate."""
    ground = ["the ground"] if model == "spatial" else []
    links = [] if trajectory.self_contact_force is None else ["another link"]
    return " or ".join(["an obstacle", *ground, *links])


def _warn_of_samples(gait: JointTrajectory, duration: float) -> None:
    """Warns of samples that all lie outside the run, as those of a clock do."""
    first, last = np.asarray(gait.time)[[0, -1]]
    if last <= 0.0 or first >= duration:
        warnings.warn(
            f"gait.time, {first:g} to {last:g} s, lies outside the run, which begins at 0: the joints stay at the "
            "nearest sample. Times of a clock become those of a run by time - time[0]",
            stacklevel=3,
        )


def _warn_of_penetration(trajectory: Trajectory, where: str) -> None:
    """Warns of a penetration above ``VISIBLE_PENETRATION``."""
    if trajectory.max_penetration > VISIBLE_PENETRATION:
        depth = f"{trajectory.max_penetration:.2g} m"
        warnings.warn(f"a link penetrated {where} by {depth}: does the robot start in contact?", stacklevel=3)


def _warn_of_unconverged(trajectory: Trajectory) -> None:
    """Warns of solves that ended before their tolerance."""
    unconverged = trajectory.unconverged.sum()
    if unconverged:
        first = trajectory.time[np.argmax(trajectory.unconverged > 0)]
        warnings.warn(
            f"{unconverged:.0f} solves ended before their tolerance, the first by t = {first:g} s, with residuals "
            f"up to {trajectory.residual.max():.1g} m/s (Trajectory.unconverged, Trajectory.residual): take a smaller "
            "Integrator.step or a larger Integrator.max_iterations",
            stacklevel=3,
        )
