"""One scripted run of the thesis, and results by name of experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from snake_env.config import PD, Gait, Integrator, IOLinearizing, Noise, Robot, Scene, Start
from snake_env.reproduce.serpenoid import NaturalPath
from snake_env.simulation import simulate
from snake_env.trajectory import Trajectory

PERIOD = 4.5
"""Period of the gaits (7.3), (7.4) and (7.5) [s]."""
AIKO = Robot()
"""With the values of (T Table 7.1)."""
DEFAULT = Integrator()
"""The environments' method."""
TABLE_7_2 = Integrator(method="thesis")
"""The thesis's scheme with the step, tolerance and r's of (T Table 7.2)."""

Method = Literal["implicit", "thesis"]
"""How runs are integrated: by the environments' method, or as printed."""


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
        noise: on the measurements.
        robot: the chain of links.
        sample: interval between samples [s]; None: that of the runs.
        reference_rate: how often the joints take over a reference [1/s]; None: continuously.
        reference_delay: by how much it is late [s].
        integrator: for the method "implicit".
        printed: for the method "thesis": what the section of the experiment prescribes.
    """

    scene: Scene
    duration: float
    gait: Gait = field(default_factory=Gait)
    start: Start | None = None
    model: str = "planar"
    controller: PD | IOLinearizing | None = None
    noise: Noise | None = None
    robot: Robot = AIKO
    sample: float | None = None
    reference_rate: float | None = None
    reference_delay: float = 0.0
    integrator: Integrator = DEFAULT
    printed: Integrator = TABLE_7_2

    def simulate(self, method: Method = "implicit", sample: float = 0.01) -> Trajectory:
        """The run, sampled every ``sample`` seconds unless the experiment has its own interval."""
        return simulate(
            model=self.model,
            robot=self.robot,
            scene=self.scene,
            gait=self.gait,
            controller=self.controller,
            integrator=self.printed if method == "thesis" else self.integrator,
            start=self.start,
            duration=self.duration,
            sample=sample if self.sample is None else self.sample,
            noise=self.noise,
            reference_rate=self.reference_rate,
            reference_delay=self.reference_delay,
        )


class Runs:
    """Results by name of experiment; each is simulated once.

    Args:
        experiments: by name.
        method: of integration.
        sample: interval between samples [s].
    """

    def __init__(
        self, experiments: Mapping[str, Experiment], method: Method = "implicit", sample: float = 0.01
    ) -> None:
        self._experiments = experiments
        self._method = method
        self._sample = sample
        self._done: dict[str, Trajectory] = {}

    def experiment(self, name: str) -> Experiment:
        """What is simulated."""
        return self._experiments[name]

    def no_slip_speed(self, name: str) -> float:
        """Upper bound of an experiment's mean speed [m/s]."""
        experiment = self.experiment(name)
        return NaturalPath(experiment.gait, float(np.mean(experiment.robot.length))).no_slip_speed

    def __getitem__(self, name: str) -> Trajectory:
        if name not in self._done:
            self._done[name] = self.experiment(name).simulate(self._method, self._sample)
        return self._done[name]
