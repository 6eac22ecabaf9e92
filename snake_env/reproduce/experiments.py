"""What is simulated: the experiments of each section of the thesis, by name."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

from snake_env.config import PD, Gait, Integrator, IOLinearizing, Noise, Robot, Scene, Start
from snake_env.config.section import DEGREE
from snake_env.minimal import TABLE_7_2_GROUND, TABLE_7_2_PD
from snake_env.reproduce import broken, comparison, compliant, lyapunov, mechanism, placement, slope, stairs
from snake_env.reproduce.experiment import DEFAULT, PERIOD, TABLE_7_2, Experiment

FRICTION_PAIRS = ((0.2, 0.2), (0.2, 0.5), (0.01, 1.0))
"""(mu_x, mu_y) of sections 7.3.2 and 7.3.3."""
ISOTROPIC, ORTHOTROPIC, WHEELED = FRICTION_PAIRS
LINK_DIAMETER = 0.105
"""2 L_SC, by which (T 7.7) moves peg 3 [m]."""
LIFTS = (0.25, 0.5, 1.0, 2.0, 3.0)
"""Vertical amplitudes of sinus-lifting [deg]."""
FRICTIONS = (0.1, 0.2, 0.4)
"""Isotropic coefficients of section 7.5.2: half of, as, and twice of (T Table 7.1)."""
RATES = (0.5, 1.0, 2.0)
"""Of the gait on the course of Table 7.3, over that of (T 7.3)."""
FAST = (2.0, 4.0, 8.0)
"""The same on the course of Table 7.5, with motors that give ``WEAK_TORQUE``."""
WEAK_TORQUE = 3.0
"""A third of the largest torque among the pegs of Table 7.3 [N m]."""
FREE_PLAY = (3, 5)
"""Of Aiko's joints (T 7.5.4) [deg]."""
AS_BUILT = ("free play", "10 Hz", "10 Hz, late", "motors", "all")
"""Of Aiko, on the course of Table 7.5."""
WEAK_GAIN = 15.0
"""k_P of joints that sag by as much as Aiko's play while they lift its links [N m/rad]."""
SATURATED = 1.5
"""Torque limit at which the motors no longer lift the links as asked [N m]."""
PHASES = (-90, 60, 90, 120)
"""beta_0 of sidewinding [deg]."""
OFFSETS = (-10, 0, 10)
"""gamma_h of sidewinding [deg]."""
FILLED = Robot(contact_half_length=0.061)
"""Aiko with straight sides up to the joints, without the cracks between the round ends of its links."""
STRAIGHT = Start(position=(0.061, 0.0), heading=0.0, posture="straight")
"""O_2 at the origin, along +x."""
FEEDBACK: dict[str, PD | IOLinearizing] = {
    "IO": IOLinearizing(),
    "PD": TABLE_7_2_PD,
    "IO 10 N m": IOLinearizing(torque_limit=10.0),
    "PD 10 N m": dataclasses.replace(TABLE_7_2_PD, torque_limit=10.0),
    "PD high": PD(kp=2e4, kd=120.0),
}
"""Joint controllers of section 7.3.5 by name."""
FRICTION_LAWS = ("set-valued", "arctan", "ellipse")
"""Of section 7.3.5: (6.25), (6.21), and the smooth form of the first."""

Experiments = dict[str, Experiment]


@cache
def experiments() -> Experiments:
    """All of them."""
    others = comparison.experiments() | compliant.experiments() | mechanism.experiments() | lyapunov.experiments()
    flat = _obstacle_aided() | _free()
    others |= broken.experiments(flat) | slope.experiments() | stairs.experiments()
    spatial = _in_3d(flat) | _lifting() | _drop() | _rolling() | _sidewinding() | _steered_sidewinding()
    return others | flat | _parameters() | _free_play() | _as_built() | spatial | _weak_joints() | _control() | _noise()


def _obstacle_aided() -> Experiments:
    """Sections 7.3.4 and 7.5.3 with the planar model."""
    course = Scene.preset("table-7.3")
    found = {
        "table 7.5": Experiment(Scene.preset("table-7.5"), 2 * PERIOD),
        "table 7.3": Experiment(course, 15.0),
        "peg 3 moved": Experiment(course.moved(3, 0.0, LINK_DIAMETER), 15.0),
        "peg 3 removed": Experiment(course.without(3), 15.0),
    }
    for beta in (-30, -50, -70):
        gait = Gait.lateral_undulation(beta=beta * DEGREE)
        scene, start = placement.course(gait)
        found[f"beta {beta}"] = Experiment(scene, 2 * PERIOD, gait, start)
        found[f"beta {beta}, no pegs"] = Experiment(Scene(), 2 * PERIOD, gait)
    return found


def _parameters() -> Experiments:
    """What sections 7.3.4 and 7.5.3 tell of the body, amplitude and rate of the gait among pegs."""
    course = Scene.preset("table-7.3")
    found = {"table 7.3, filled": Experiment(course, 15.0, robot=FILLED)}
    flat = Gait.lateral_undulation(amplitude=30 * DEGREE)
    scene, start = placement.course(flat)
    found["amplitude 30"] = Experiment(scene, 2 * PERIOD, flat, start)
    found["amplitude 30, no pegs"] = Experiment(Scene(), 2 * PERIOD, flat)
    for rate in RATES:
        gait = Gait(omega=rate * Gait().omega)
        found[f"rate {rate:g}"] = Experiment(course, 15.0 / rate, gait, integrator=Integrator(step=2.5e-3))
    for rate in FAST:
        gait, motors = Gait(omega=rate * Gait().omega), PD(torque_limit=WEAK_TORQUE)
        found[f"rate {rate:g}, weak motors"] = Experiment(
            Scene.preset("table-7.5"), 2 * PERIOD / rate, gait, controller=motors, integrator=Integrator(step=2.5e-3)
        )
    return found


def _free() -> Experiments:
    """Section 7.5.2 with the planar model."""
    return {
        "free": Experiment(Scene.preset("free", ISOTROPIC), 2 * PERIOD),
        "orthotropic": Experiment(Scene.preset("free", ORTHOTROPIC), 2 * PERIOD),
    } | {f"free, mu {mu:g}": Experiment(Scene.preset("free", (mu, mu)), 2 * PERIOD) for mu in FRICTIONS}


def _free_play() -> Experiments:
    """Section 7.5.4 on the ground of section 7.5.2; the printed scheme has no free play."""
    ground = Scene.preset("free", ISOTROPIC)
    return {
        f"free play {angle}": _always(DEFAULT, Experiment(ground, 2 * PERIOD, robot=Robot(backlash=angle * DEGREE)))
        for angle in FREE_PLAY
    }


def _as_built() -> Experiments:
    """Aiko's discrepancies (T 7.5.4) on the course of section 7.5.3, each by itself and all together."""
    held, late = {"reference_rate": 10.0}, {"reference_rate": 10.0, "reference_delay": 0.1}
    course = Experiment(Scene.preset("table-7.5"), 2 * PERIOD, integrator=DEFAULT, printed=DEFAULT)
    changes: dict[str, dict[str, Any]] = {
        "free play": {"robot": Robot.aiko()},
        "10 Hz": held,
        "10 Hz, late": late,
        "motors": {"controller": PD.aiko()},
        "all": {"robot": Robot.aiko(), "controller": PD.aiko(), **late},
    }
    return {f"as built: {name}": dataclasses.replace(course, **change) for name, change in changes.items()}


def _in_3d(flat: Experiments) -> Experiments:
    """Experiments of the planar model with the spatial one, from that model's own start."""
    names = (
        "free",
        *(f"free, mu {mu:g}" for mu in FRICTIONS),
        "table 7.5",
        "table 7.3",
        "peg 3 moved",
        "peg 3 removed",
    )
    starts = {name: Start.on_course(flat[name].scene, "spatial") for name in names}
    return {f"{name}, 3D": dataclasses.replace(flat[name], start=starts[name], model="spatial") for name in names}


def _lifting() -> Experiments:
    """Gaits of section 2.4.2 that the thesis describes and does not simulate.

    The caterpillar stands on spheres in a row, which is unstable: the run ends before round-off tips it over.
    """
    caterpillar = Gait.caterpillar(soft_start=True)
    found = {
        "undulation, 3D": _spatial(ORTHOTROPIC, Gait()),
        "caterpillar": _spatial(ISOTROPIC, caterpillar, Start(posture="straight"), 1.5 * PERIOD),
    }
    for lift in LIFTS:
        found[f"lift {lift:g}"] = _spatial(ORTHOTROPIC, Gait.sinus_lifting(vertical_amplitude=lift * DEGREE))
    return found


def _drop() -> Experiments:
    """Section 7.3.1: inclined by 30 degrees, link 1 lowest, 0.3 m above the ground; actuators on from 1 s.

    The fall is an avalanche of impacts, whose order decides how far the robot slides.
    """
    start = Start(position=(0.0, 0.0, 0.3525), pitch=30 * DEGREE, posture="straight")
    drop = Experiment(
        Scene(friction=ORTHOTROPIC),
        10.0,
        Gait(soft_start=True),
        start,
        "spatial",
        PD(active_from=1.0),
        integrator=Integrator(step=1e-3),
        printed=dataclasses.replace(TABLE_7_2, r_n=0.01),  # "Particular simulation parameters: [...] r_N = 0.01"
    )
    return {
        "drop": drop,
        "drop, implicit": _always(drop.integrator, drop),
        "drop, as printed": _always(drop.printed, drop),
        "drop, r_N of Table 7.2": _always(TABLE_7_2, drop),
    }


def _rolling() -> Experiments:
    """Section 7.3.2."""
    found = {f"rolling {pair}": _spatial(pair, Gait.lateral_rolling(), duration=15.0) for pair in FRICTION_PAIRS}
    on_the_other_side = dataclasses.replace(found[f"rolling {ISOTROPIC}"], start=Start(roll=90 * DEGREE))
    return found | _loose_and_solved(f"rolling {WHEELED}", found) | {"rolling, other side": on_the_other_side}


def _sidewinding() -> Experiments:
    """Sections 7.3.3 and 7.5.1."""
    gait, start = Gait.sidewinding(soft_start=True), Start(posture="straight")
    found = {f"sidewinding {pair}": _spatial(pair, gait, start, 15.0) for pair in FRICTION_PAIRS}
    return found | _loose_and_solved(f"sidewinding {WHEELED}", found)


def _steered_sidewinding() -> Experiments:
    """Section 2.4.2: the parameters that control the direction of sidewinding."""
    straight = Start(posture="straight")
    phases = {f"beta_0 {phase}": {"vertical_phase": phase * DEGREE} for phase in PHASES}
    offsets = {f"gamma_h {offset}": {"gamma": offset * DEGREE} for offset in OFFSETS}
    return {
        f"sidewinding, {name}": _spatial(ISOTROPIC, Gait.sidewinding(soft_start=True, **changes), straight, 15.0)
        for name, changes in (phases | offsets).items()
    }


def _weak_joints() -> Experiments:
    """Section 7.5.4 while sidewinding: joints that sag, motors that saturate."""
    exact = _sidewinding()[f"sidewinding {ISOTROPIC}"]
    controllers = {"weak joints": PD(kp=WEAK_GAIN, kd=0.5), "saturated": PD(torque_limit=SATURATED)}
    return {
        f"sidewinding, {name}": dataclasses.replace(exact, controller=controller)
        for name, controller in controllers.items()
    }


def _control() -> Experiments:
    """Section 7.3.5 without noise: straight and at rest, lateral undulation with soft start.

    The thesis leaves smooth friction to Matlab's ode15s; here the smooth plants have one solver, whatever the method.
    High PD gains are integrated implicitly too: the printed scheme is stable below 2 / (2894 * 120) s = 5.8 us.
    """
    found = {}
    for law in FRICTION_LAWS:
        scene = dataclasses.replace(TABLE_7_2_GROUND, friction_law=law)
        for name, controller in FEEDBACK.items():
            experiment = Experiment(scene, 20.0, Gait(soft_start=True), STRAIGHT, "minimal", controller)
            printable = law == "set-valued" and name != "PD high"
            found[f"{name}, {law}"] = experiment if printable else _always(DEFAULT, experiment)
    return found


def _noise() -> Experiments:
    """Section 7.3.5 with the rows of Table 7.4: the thesis measures once per step of 2.5e-4 s."""
    found = {}
    for name in ("IO", "PD"):
        plain = _control()[f"{name}, set-valued"]
        held = dataclasses.replace(FEEDBACK[name], treatment="step")
        measured = dataclasses.replace(plain, controller=held, integrator=Integrator(step=2.5e-4))
        for row in "bcd":
            found[f"{name}, noise {row}"] = dataclasses.replace(measured, noise=Noise.table_7_4(row))
    return found


def _spatial(
    friction: tuple[float, float], gait: Gait, start: Start | None = None, duration: float = 2 * PERIOD
) -> Experiment:
    return Experiment(Scene(friction=friction), duration, gait, start, "spatial")


def _always(integrator: Integrator, experiment: Experiment) -> Experiment:
    """With the same integrator whatever the method of the runs."""
    return dataclasses.replace(experiment, integrator=integrator, printed=integrator)


def _loose_and_solved(name: str, found: Experiments) -> Experiments:
    """An experiment at the tolerance of Table 7.2, and with contacts solved."""
    return {
        f"{name}, Table 7.2": _always(TABLE_7_2, found[name]),
        f"{name}, solved": _always(DEFAULT, found[name]),
    }
