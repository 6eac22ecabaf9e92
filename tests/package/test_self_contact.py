"""Contact of the planar robot with itself: how errors fall with the step, and an outside witness."""

from __future__ import annotations

import numpy as np
import pytest

import snake_env
from snake_env import PD, Gait, Integrator, Robot, Scene, Start

CURL = 1.1
"""Reference of all joints: seven links would close a ring [rad]."""


def coil(step, *, back_to_front=False, self_contact=True, duration=0.3, controller=None):
    """Positions (T, n, 2) of a straight robot that coils up, links in one order whichever way they are numbered."""
    start = Start(posture="straight")
    if back_to_front:
        straight = snake_env.simulate(gait=Gait(amplitude=0.0), start=start, duration=0.1)
        start = Start(position=straight.position[0, -1], heading=straight.angle[0, 0] + np.pi, posture="straight")
    run = snake_env.simulate(
        robot=Robot(self_contact=self_contact),
        scene=Scene(friction=(0.2, 0.3)),
        gait=Gait(amplitude=0.0, gamma=-CURL if back_to_front else CURL),
        controller=controller,
        start=start,
        integrator=Integrator(step=step),
        duration=duration,
        sample=duration,
    )
    assert (run.self_contact_force is not None and np.abs(run.self_contact_force).max() > 1.0) == self_contact
    return run.position[:, ::-1] if back_to_front else run.position


def test_errors_fall_with_the_step_after_links_have_met():
    """First order: impacts are taken by Euler steps, and when a contact closes is known to a part of a step."""
    weak = PD(torque_limit=5.0)
    fine = coil(1e-4, controller=weak)
    errors = [np.abs(coil(step, controller=weak) - fine).max() for step in (2e-3, 5e-4)]
    assert errors[1] < 4e-3
    assert errors[0] / errors[1] > 4.0**0.8


@pytest.mark.parametrize(("self_contact", "least"), [(False, 3e-4), (True, 1e-3)])
def test_the_numbering_of_the_links_matters_no_more_than_the_step(self_contact, least):
    """The chain is put together from link 1, so positions of a robot numbered from its other end differ by the error of
    the step, with self-contact and without it; nothing else depends on the numbering."""
    differences = [
        np.abs(coil(step, self_contact=self_contact) - coil(step, back_to_front=True, self_contact=self_contact)).max()
        for step in (1e-2, 3e-4)
    ]
    assert differences[1] < least
    assert differences[0] > 3.0 * differences[1]


def test_mujoco_s_capsules_coil_up_alike():
    """Without friction, under overdamped PD that presses the links on each other; MuJoCo's contacts are stiff springs
    with dampers, ours are rigid: joint angles within 1e-3 rad. Links 2 mm thinner would be off by 4e-3 rad."""
    mujoco = pytest.importorskip("mujoco")
    links, kp, kd, duration = 9, 20.0, 3.0, 2.0
    run = snake_env.simulate(
        robot=Robot(links=links),
        scene=Scene(friction=(0.0, 0.0)),
        gait=Gait(amplitude=0.0, gamma=CURL),
        controller=PD(kp=kp, kd=kd),
        start=Start(posture="straight"),
        integrator=Integrator(step=1e-3),
        duration=duration,
        sample=0.1,
    )
    assert np.abs(run.self_contact_force[-1]).max() > 1.0
    model = mujoco.MjModel.from_xml_string(_chain(links, kp, kd))
    data = mujoco.MjData(model)
    data.ctrl[:] = CURL
    angles = [data.qpos[3:].copy()]
    for _ in range(20):
        mujoco.mj_step(model, data, round(0.1 / model.opt.timestep))
        angles.append(data.qpos[3:].copy())
    assert data.ncon > 0
    np.testing.assert_allclose(np.array(angles), run.joint_angle, atol=1e-3)


def _chain(links, kp, kd):
    """The robot as MuJoCo describes it: capsules that touch without friction, PD motors, no gravity."""
    geom = '<geom type="capsule" size="0.0525" fromto="-0.0393 0 0 0.0393 0 0" condim="1" friction="0 0 0" mass="0"/>'
    mass = f'<inertial pos="0 0 0" mass="{7.5 / 11}" diaginertia="1e-3 1e-3 1.32e-3"/>'
    bodies = ""
    for i in reversed(range(1, links)):
        hinge = f'<joint name="j{i}" type="hinge" axis="0 0 1" pos="-0.061 0 0"/>'
        bodies = f'<body pos="0.122 0 0">{hinge}{mass}{geom}{bodies}</body>'
    root = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>'
    motors = "".join(f'<position joint="j{i}" kp="{kp}" kv="{kd}"/>' for i in range(1, links))
    return f"""<mujoco><option timestep="1e-4" gravity="0 0 0" integrator="implicitfast"/>
      <default><geom solref="0.002 1" solimp="0.99 0.999 0.0001"/></default>
      <worldbody><body>{root}{mass}{geom}{bodies}</body></worldbody><actuator>{motors}</actuator></mujoco>"""


def test_angular_momentum_in_flight_drifts_less_at_a_finer_precision():
    """A robot coils up while it falls; the impulses of a joint on its two links meet at the end of a step only."""
    robot = Robot()
    bends = np.zeros((3, robot.links - 1, 2))
    bends[1:] = 0.9, 0.02
    coil = snake_env.JointTrajectory(np.array([0.0, 0.4, 2.0]), bends)

    def drift(precision):
        run = snake_env.simulate(
            "spatial",
            gait=coil,
            start=Start(position=(0.0, 0.0, 6.0), posture="straight"),
            controller=snake_env.PD(kp=200.0, kd=2.0),
            precision=precision,
            duration=0.8,
            sample=0.05,
            record=["velocity", "self_contacts"],
        )
        assert np.abs(run.pair_force).max() > 200.0
        w, x, y, z = np.moveaxis(run.quaternion, -1, 0)
        axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)
        roll = (run.angular_velocity * axis).sum(axis=-1, keepdims=True) * axis
        spin = np.mean(robot.inertia) * (run.angular_velocity - roll) + np.mean(robot.roll_inertia) * roll
        place, velocity = (of - of.mean(axis=1, keepdims=True) for of in (run.position, run.velocity))
        momentum = (np.mean(robot.mass) * np.cross(place, velocity) + spin).sum(axis=1)
        return np.linalg.norm(momentum - momentum[0], axis=1).max()

    coarse, fine = drift("default"), drift("fine")
    print(f"{coarse:.4f} and {fine:.4f} N m s")
    assert coarse < 0.02
    assert fine < 0.5 * coarse
