"""What Coulomb friction holds stays where it is, on slopes and between walls; what it does not hold slides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from snake_env import PD, Gait, Integrator, Robot, Scene, Start, Trajectory, simulate
from snake_env.config.robot import per_link
from snake_env.obstacles import Segment

MU, WALL_MU = 0.3, 0.7
SERVO = PD(torque_limit=10.0)
SETTLED, UNTIL = 1.0, 11.0
"""Between these times [s] speeds are measured."""


@dataclass(frozen=True)
class Case:
    """A robot, where it lies, and what its joints are told."""

    scene: Scene
    start: Start
    robot: Robot
    target: Gait

    def simulate(self, **options) -> Trajectory:
        return simulate(
            robot=self.robot, scene=self.scene, gait=self.target, controller=SERVO, start=self.start, **options
        )


def straight(share: float) -> Case:
    """The straight robot along a slope of ``share`` of the critical one."""
    return Case(sloped(share), Start(heading=0.0, posture="straight"), Robot(), Gait(amplitude=0.0))


def resting() -> Case:
    """The robot in the posture of the gait, which its servos hold, on half the critical slope."""
    return Case(sloped(0.5), Start(heading=0.0), Robot(), Gait(omega=0.0))


def sloped(share: float) -> Scene:
    """Ground without rolling friction; coordinates are the ground's."""
    return Scene(friction=(MU, MU), rolling_friction=0.0, slope=(float(np.arctan(share * MU)), 0.0))


def braced(bend: float = 0.5, play: float = 1e-3) -> Case:
    """Two links in a V between walls along which gravity acts, held by the torque that bends them further."""
    robot = Robot(links=2)
    length, half, radius = (per_link(value, 1)[0] for value in (robot.length, robot.contact_half_length, robot.radius))
    length *= 0.5
    width = 2.0 * (half * np.sin(bend) + radius) + play
    apex = width - radius - 0.5 * play + (length - half) * np.sin(bend)
    position = (-length * float(np.cos(bend)), float(apex - length * np.sin(bend)))
    walls = [Segment((-1.0, y), (1.0, y), friction=WALL_MU) for y in (0.0, float(width))]
    scene = Scene(obstacles=walls, friction=(0.0, 0.0), rolling_friction=0.0, slope=(0.5 * np.pi, 0.0))
    start = Start(position=position, heading=bend, posture=[-2.0 * bend])
    return Case(scene, start, robot, Gait(amplitude=0.0, gamma=-3.0 * bend))


def places(model: str, case: Case, *times: float) -> list[np.ndarray]:
    """CGs (n, 2) of the links at these multiples of the first time."""
    # At the default step the planar links creep within the tolerance of the solver.
    fine = Integrator(step=1e-3) if model == "planar" and case.scene.obstacles else None
    run = case.simulate(model=model, integrator=fine, duration=times[-1], sample=times[0])
    return [run.position[round(time / times[0]), :, :2] for time in times]


def creep(model: str, case: Case, until: float) -> float:
    """How far the link that moves most goes once it has settled [m]."""
    before, after = places(model, case, SETTLED, until)
    return np.linalg.norm(after - before, axis=-1).max()


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_what_coulomb_friction_holds_rests_and_what_it_does_not_hold_slides(model):
    for case in (straight(0.999), braced()):
        assert creep(model, case, UNTIL) / (UNTIL - SETTLED) < 1e-15, "m/s"
    assert creep(model, resting(), 60.0) < 1e-15
    case = straight(1.001)
    first, middle, last = (at[:, 0].mean() for at in places(model, case, SETTLED, 0.5 * (SETTLED + UNTIL), UNTIL))
    acceleration = (first - 2.0 * middle + last) / (0.5 * (UNTIL - SETTLED)) ** 2
    angle = case.scene.slope[0]
    friction = (acceleration / Robot().gravity + np.sin(angle)) / (MU * np.cos(angle))
    assert friction == pytest.approx(1.0, abs=1e-6), "over mu N"


@pytest.mark.parametrize("step", [25e-3, 5e-3, 1e-3, 5e-4])
def test_two_links_brace_themselves_between_rough_walls(step):
    run = braced().simulate(integrator=Integrator(step=step), duration=2.0)
    assert run.unconverged.sum() == 0
    assert abs(run.position[-1] - run.position[10]).max() < 1e-9
