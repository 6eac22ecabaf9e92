"""What is simulated: each experiment by name, run when it is first asked for."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from snake_env.config import PD, Gait, Integrator, IOLinearizing, Noise, Robot, Scene, Start
from snake_env.minimal import TABLE_7_2_GROUND, TABLE_7_2_PD
from snake_env.reproduce import placement
from snake_env.reproduce.serpenoid import NaturalPath
from snake_env.simulation import simulate
from snake_env.trajectory import Trajectory

DEGREE = math.pi / 180.0
PERIOD = 4.5
"""Period of the gait (7.3) [s]."""
LINK_DIAMETER = 0.105
"""2 L_SC, by which (7.7) moves peg 3 [m]."""


@dataclass(frozen=True)
class Experiment:
    """One scripted run.

    Args:
        scene: pegs and friction.
        duration: [s].
        gait: joint references.
        start: None: that of the scene's preset.
        model: of the thesis.
        controller: None: the model's PD controller.
        integrator: None: that of all runs.
        noise: on the measurements.
    """

    scene: Scene
    duration: float
    gait: Gait = field(default_factory=Gait)
    start: Start | None = None
    model: str = "planar"
    controller: PD | IOLinearizing | None = None
    integrator: Integrator | None = None
    noise: Noise | None = None

    def simulate(self, integrator: Integrator | None, sample: float, robot: Robot | None = None) -> Trajectory:
        """The run, by an integrator of its own or not, sampled every ``sample`` seconds."""
        return simulate(
            model=self.model,
            robot=robot,
            scene=self.scene,
            gait=self.gait,
            controller=self.controller,
            integrator=integrator,
            start=self.start,
            duration=self.duration,
            sample=sample,
            noise=self.noise,
        )


def _preset(name: str, duration: float, friction: tuple[float, float] = (0.2, 0.2)) -> Experiment:
    return Experiment(Scene.preset(name, friction), duration)


def _placed(beta: float) -> Experiment:
    gait = Gait.lateral_undulation(beta=beta * DEGREE)
    scene, start = placement.course(gait)
    return Experiment(scene, 9.0, gait, start)


EXPERIMENTS: dict[str, Callable[[], Experiment]] = {
    "free": lambda: _preset("free", 2 * PERIOD),
    "orthotropic": lambda: _preset("free", 2 * PERIOD, (0.2, 0.5)),
    "table 7.5": lambda: _preset("table-7.5", 2 * PERIOD),
    "table 7.3": lambda: _preset("table-7.3", 15.0),
    "peg 3 moved": lambda: Experiment(Scene.preset("table-7.3").moved(3, 0.0, LINK_DIAMETER), 15.0),
    "peg 3 removed": lambda: Experiment(Scene.preset("table-7.3").without(3), 15.0),
    "beta -30": lambda: _placed(-30.0),
    "beta -50": lambda: _placed(-50.0),
    "beta -70": lambda: _placed(-70.0),
}


FRICTION_PAIRS = ((0.2, 0.2), (0.2, 0.5), (0.01, 1.0))
"""(mu_x, mu_y) of sections 7.3.2 and 7.3.3."""
TABLE_7_2 = Integrator(method="thesis")
"""The thesis's scheme with its own step and tolerance."""


def _drop() -> Experiment:
    """Section 7.3.1: inclined by 30 degrees, link 1 lowest, 0.3 m above the ground; actuators on from 1 s."""
    start = Start(position=(0.0, 0.0, 0.3525), pitch=30 * DEGREE, posture="straight")
    scene, gait = Scene(friction=(0.2, 0.5)), Gait(soft_start=True)
    return Experiment(scene, 10.0, gait, start, "spatial", PD(active_from=1.0))


def _rolling(friction: tuple[float, float], integrator: Integrator | None = None) -> Experiment:
    return Experiment(Scene(friction=friction), 15.0, Gait.lateral_rolling(), None, "spatial", integrator=integrator)


def _sidewinding(friction: tuple[float, float]) -> Experiment:
    start = Start(posture="straight")
    return Experiment(Scene(friction=friction), 15.0, Gait.sidewinding(soft_start=True), start, "spatial")


def _in_space(planar: str) -> Experiment:
    """An experiment of the planar model with the spatial one, from that model's own start."""
    experiment = EXPERIMENTS[planar]()
    start = Start.on_course(experiment.scene, "spatial")
    return dataclasses.replace(experiment, start=start, model="spatial")


def _lifting(gait: Gait, friction: tuple[float, float]) -> Experiment:
    """Gaits of section 2.4.2 that the thesis describes and does not simulate."""
    start = Start(posture="straight" if gait.soft_start else "gait")
    return Experiment(Scene(friction=friction), 2 * PERIOD, gait, start, "spatial")


EXPERIMENTS["drop"] = _drop
EXPERIMENTS["undulation, 3D"] = lambda: _lifting(Gait(), (0.2, 0.5))
EXPERIMENTS["sinus-lifting"] = lambda: _lifting(Gait.sinus_lifting(), (0.2, 0.5))
EXPERIMENTS["caterpillar"] = lambda: _lifting(Gait.caterpillar(soft_start=True), (0.2, 0.2))
EXPERIMENTS["rolling (0.01, 1.0), Table 7.2"] = partial(_rolling, (0.01, 1.0), TABLE_7_2)
EXPERIMENTS["rolling (0.01, 1.0), solved"] = partial(_rolling, (0.01, 1.0), Integrator())
for _pair in FRICTION_PAIRS:
    EXPERIMENTS[f"rolling {_pair}"] = partial(_rolling, _pair)
    EXPERIMENTS[f"sidewinding {_pair}"] = partial(_sidewinding, _pair)
for _name in ("free", "table 7.5", "table 7.3", "peg 3 moved", "peg 3 removed"):
    EXPERIMENTS[f"{_name}, 3D"] = partial(_in_space, _name)

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


def _controlled(controller: str, law: str) -> Experiment:
    """Section 7.3.5 without noise: straight and at rest, lateral undulation with soft start."""
    scene = dataclasses.replace(TABLE_7_2_GROUND, friction_law=law)
    integrator = None if law == "set-valued" else Integrator()
    gait = Gait(soft_start=True)
    return Experiment(scene, 20.0, gait, STRAIGHT, "minimal", FEEDBACK[controller], integrator)


def _noisy(controller: str, row: str) -> Experiment:
    """The same with a row of Table 7.4: the thesis measures once a step of 2.5e-4 s."""
    held = dataclasses.replace(FEEDBACK[controller], treatment="step")
    plain = _controlled(controller, "set-valued")
    noise = Noise.table_7_4(row)
    return dataclasses.replace(plain, controller=held, integrator=Integrator(step=2.5e-4), noise=noise)


for _law in ("set-valued", "arctan", "ellipse"):
    for _name in FEEDBACK:
        EXPERIMENTS[f"{_name}, {_law}"] = partial(_controlled, _name, _law)
for _row in "bcd":
    for _name in ("IO", "PD"):
        EXPERIMENTS[f"{_name}, noise {_row}"] = partial(_noisy, _name, _row)


class Runs:
    """Results by name of experiment; each is simulated once.

    Args:
        integrator: None: the default of the environments.
        sample: interval between samples [s].
    """

    robot = Robot()

    def __init__(self, integrator: Integrator | None = None, sample: float = 0.01) -> None:
        self._integrator = integrator
        self._sample = sample
        self._done: dict[str, tuple[Experiment, Trajectory]] = {}

    def experiment(self, name: str) -> Experiment:
        """What was simulated."""
        return self._run(name)[0]

    def no_slip_speed(self, name: str) -> float:
        """Upper bound of an experiment's mean speed [m/s]."""
        return NaturalPath(self.experiment(name).gait, float(np.mean(self.robot.length))).no_slip_speed

    def __getitem__(self, name: str) -> Trajectory:
        return self._run(name)[1]

    def _run(self, name: str) -> tuple[Experiment, Trajectory]:
        if name not in self._done:
            experiment = EXPERIMENTS[name]()
            integrator = experiment.integrator or self._integrator
            self._done[name] = (experiment, experiment.simulate(integrator, self._sample, self.robot))
        return self._done[name]
