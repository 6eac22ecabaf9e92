"""Limits of sampled joint control: control period against gains."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snake_env.config import PD, Gait, Integrator, IOLinearizing, Scene, Start
from snake_env.errors import DivergenceError
from snake_env.minimal import TABLE_7_2_PD
from snake_env.simulation import simulate

Array = NDArray[np.float64]
Controller = PD | IOLinearizing

PERIODS = 300
"""Control periods after which a disturbed joint must have calmed down."""
DISTURBANCE = 1e-3
"""Angle by which joint 5 of the straight robot is off at first [rad]."""
SMOOTH_ICE = Scene(friction=(0.0, 0.0))
"""No friction: what is left is the loop of controller and inertia."""
STILL = Gait(amplitude=0.0)
MOBILITY = 2894.0
"""Largest eigenvalue of M22_bar^-1 of straight Aiko [1/(kg m^2)]; a test recomputes it."""


@dataclass(frozen=True)
class Treatment:
    """How a torque is computed from sampled states, and how the plant is integrated meanwhile."""

    name: str
    method: str
    substeps: int
    held: bool

    def recovers(self, controller: Controller, period: float) -> bool:
        """Whether a small disturbance dies out with the control period [s]."""
        posture = np.zeros(10)
        posture[4] = DISTURBANCE
        if self.held:
            controller = dataclasses.replace(controller, treatment=period)
        try:
            run = simulate(
                model="minimal",
                scene=SMOOTH_ICE,
                gait=STILL,
                controller=controller,
                integrator=Integrator(method=self.method, step=period / self.substeps, tolerance=1e-9),
                start=Start(posture=posture.tolist()),
                duration=PERIODS * period,
                sample=PERIODS * period / 3,
            )
        except DivergenceError:
            return False
        return bool(np.abs(run.joint_angle[1:]).max() < 3.0 * DISTURBANCE)


TREATMENTS = [
    Treatment("explicit", "thesis", 1, False),
    Treatment("held", "implicit", 4, True),
    Treatment("implicit", "implicit", 1, False),
]


def critically_damped(kd: float) -> IOLinearizing:
    """K_P = K_D^2 / 4."""
    return IOLinearizing(kp=0.25 * kd * kd, kd=kd)


def proportioned(kd: float) -> PD:
    """The ratio of the thesis's gains, k_P / k_D = 200 / 1.2 1/s."""
    return PD(kp=kd * TABLE_7_2_PD.kp / TABLE_7_2_PD.kd, kd=kd)


PRINTED: list[tuple[str, Controller, float]] = [
    ("IO (4e5, 2.4e3)", IOLinearizing(), 0.83e-3),
    ("PD (200, 1.2)", TABLE_7_2_PD, 0.576e-3),
    ("PD (800, 2)", PD(kp=800.0, kd=2.0), 0.346e-3),
]
"""The thesis's gains and their limits by theory: 2 / K_D, and min(2 / (mobility k_D), 2 k_D / k_P) [s]."""


def limit(treatment: Treatment, controller: Controller, low: float, high: float, accuracy: float = 0.01) -> float:
    """The control period at which stability is lost, by bisection; infinite if not even at ``high`` [s]."""
    if treatment.recovers(controller, high):
        return float("inf")
    while high / low > 1.0 + accuracy:
        middle = float(np.sqrt(low * high))
        if treatment.recovers(controller, middle):
            low = middle
        else:
            high = middle
    return float(np.sqrt(low * high))


def grid(
    treatment: Treatment, family: Callable[[float], Controller], gains: Array, periods: Array
) -> NDArray[np.bool_]:
    """Where the family's member of each gain recovers (gains, periods)."""
    return np.array([[treatment.recovers(family(float(kd)), float(period)) for period in periods] for kd in gains])
