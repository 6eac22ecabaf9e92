"""What is simulated: the experiments of each section of the thesis, by name."""

from __future__ import annotations

import dataclasses
from functools import cache

from snake_env.config import PD, Gait, Integrator, IOLinearizing, Noise, Scene, Start
from snake_env.minimal import TABLE_7_2_GROUND, TABLE_7_2_PD
from snake_env.reproduce import placement
from snake_env.reproduce.experiment import DEFAULT, DEGREE, PERIOD, TABLE_7_2, Experiment

FRICTION_PAIRS = ((0.2, 0.2), (0.2, 0.5), (0.01, 1.0))
"""(mu_x, mu_y) of sections 7.3.2 and 7.3.3."""
ISOTROPIC, ORTHOTROPIC, WHEELED = FRICTION_PAIRS
LINK_DIAMETER = 0.105
"""2 L_SC, by which (T 7.7) moves peg 3 [m]."""
LIFTS = (0.25, 0.5, 1.0, 2.0, 3.0)
"""Vertical amplitudes of sinus-lifting [deg]."""
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
    flat = _obstacle_aided() | _free()
    return flat | _in_3d(flat) | _lifting() | _drop() | _rolling() | _sidewinding() | _control() | _noise()


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


def _free() -> Experiments:
    """Section 7.5.2 with the planar model."""
    return {
        "free": Experiment(Scene.preset("free", ISOTROPIC), 2 * PERIOD),
        "orthotropic": Experiment(Scene.preset("free", ORTHOTROPIC), 2 * PERIOD),
    }


def _in_3d(flat: Experiments) -> Experiments:
    """Experiments of the planar model with the spatial one, from that model's own start."""
    names = ("free", "table 7.5", "table 7.3", "peg 3 moved", "peg 3 removed")
    starts = {name: Start.on_course(flat[name].scene, "spatial") for name in names}
    return {f"{name}, 3D": dataclasses.replace(flat[name], start=starts[name], model="spatial") for name in names}


def _lifting() -> Experiments:
    """Gaits of section 2.4.2 that the thesis describes and does not simulate."""
    caterpillar = Gait.caterpillar(soft_start=True)
    found = {
        "undulation, 3D": _spatial(ORTHOTROPIC, Gait()),
        "caterpillar": _spatial(ISOTROPIC, caterpillar, Start(posture="straight")),
    }
    for lift in LIFTS:
        found[f"lift {lift:g}"] = _spatial(ORTHOTROPIC, Gait.sinus_lifting(vertical_amplitude=lift * DEGREE))
    return found


def _drop() -> Experiments:
    """Section 7.3.1: inclined by 30 degrees, link 1 lowest, 0.3 m above the ground; actuators on from 1 s.

    The fall is an avalanche of impacts, whose order decides how far the robot slides: with steps of 10 ms it misses a
    third of it, with 5 ms and less and with the printed scheme it slides 8.2 to 9.9 cm.
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
