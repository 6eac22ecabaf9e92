"""The 3D snake as a MuJoCo model, in the set-up that is best for MuJoCo.

Cardan joints are two hinges, yaw before pitch, under position servos with the torque law of (T 4.101), (T 4.102).
Capsules touch the ground with their two end spheres (elliptic cones, condim 3) and vertical capsules, the pegs, without
friction. Rolling friction is left out. MuJoCo's contacts are soft: friction creeps by about ``friction / impratio`` and
links sink until the ground bears them, so this model converges to a motion of its own, against which it is judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.mujoco_model import DEFAULT, STIFF
from snake_env import Gait

SETTINGS = ((1e-2, "CG"), (1e-4, "CG"), (1e-4, "Newton"))
"""Tolerances of the constraint solver and solvers that are tried."""
CONTACTS = ((2e-3, 1e3, STIFF), (2e-2, 1e3, DEFAULT))
"""Time constants [s], hardness of friction and impedances that are tried: as stiff as steps of a millisecond allow, and
MuJoCo's default but for friction."""
STEPS = (0.05, 0.025, 0.02, 0.0125, 0.01, 0.005, 0.002, 0.001, 0.0005)
QUICK_STEPS = (0.02, 0.005)
REFERENCE_STEPS = (1e-4, 5e-5)
"""Steps of the two reference runs of MuJoCo; the second is the reference, their distance its uncertainty."""
QUICK_REFERENCE_STEPS = (1e-3, 5e-4)

PEG_HEIGHT = 2.0
"""Half length of the vertical capsules [m]: no link comes near their ends."""


@dataclass(frozen=True)
class SpatialSetup:
    """What a run may choose.

    Attributes:
        step: time step [s].
        tolerance: of the constraint solver.
        contact_time: time constant of the contacts [s]; below two steps MuJoCo takes two steps.
        impratio: how much harder friction is than the normal contact.
        impedance: of the contacts.
        solver: "CG" or "Newton".
    """

    step: float
    tolerance: float = 1e-10
    contact_time: float = 1e-3
    impratio: float = 1e3
    impedance: str = STIFF
    solver: str = "Newton"


def setups(quick: bool) -> list[SpatialSetup]:
    """What is tried; the best at each error is what counts."""
    settings, contacts, steps = (SETTINGS[:1], CONTACTS[:1], QUICK_STEPS) if quick else (SETTINGS, CONTACTS, STEPS)
    return [
        SpatialSetup(step, tol, *contact, solver) for tol, solver in settings for contact in contacts for step in steps
    ]


def reference_setups(quick: bool) -> list[SpatialSetup]:
    """The two fine runs with stiff contacts, the finer one last."""
    return [SpatialSetup(step) for step in (QUICK_REFERENCE_STEPS if quick else REFERENCE_STEPS)]


def build(scenario: dict[str, Any], setup: SpatialSetup) -> mujoco.MjModel:
    """The model of a spatial scenario of ``snake-bench``."""
    return mujoco.MjModel.from_xml_string(_document(scenario, setup))


def placed(model: mujoco.MjModel, scenario: dict[str, Any]) -> mujoco.MjData:
    """The robot at rest at its start, flat on the ground."""
    data = mujoco.MjData(model)
    x, y, yaw = scenario["start"]
    data.qpos[:7] = [x, y, scenario["robot"]["radius"], np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
    data.qpos[7:] = _references(scenario, np.zeros(1))[0][0]
    return data


def servo_targets(scenario: dict[str, Any], step: float) -> NDArray[np.float64]:
    """Set-points (count, 2 joints), yaw and pitch in turn, at the ends of the steps: phi_d + kd / kp phi_d'.

    They make a servo with damping kd the PD controller.
    """
    gains = scenario["controller"]
    angle, rate = _references(scenario, step * np.arange(1, round(scenario["duration"] / step) + 1))
    return angle + gains["kd"] / gains["kp"] * rate


def _references(scenario: dict[str, Any], time: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles and rates (T, 2 joints), yaw and pitch in turn."""
    yaw, pitch, joints = scenario["yaw"], scenario["pitch"], scenario["robot"]["links"] - 1
    gait = Gait(
        amplitude=yaw["amplitude"],
        omega=yaw["omega"],
        beta=yaw["beta"],
        vertical_amplitude=pitch["amplitude"],
        vertical_omega=pitch["omega"],
        vertical_beta=pitch["beta"],
        vertical_phase=pitch["phase"],
        soft_start=scenario["soft_start"],
    )
    waves = [gait.reference(time, joints, vertical) for vertical in (False, True)]
    angle, rate = (np.stack([wave[name] for wave in waves], axis=-1) for name in ("angle", "rate"))
    return angle.reshape(len(time), -1), rate.reshape(len(time), -1)


def _document(scenario: dict[str, Any], setup: SpatialSetup) -> str:
    friction = scenario["scene"]["friction"]
    if friction[0] != friction[1]:
        raise ValueError("this model has only isotropic friction")
    contact = f'solref="{setup.contact_time} 1" solimp="{setup.impedance}"'
    gains, joints = scenario["controller"], range(1, scenario["robot"]["links"])
    limit = gains["torque_limit"]
    force_range = "" if limit is None else f'forcerange="{-limit} {limit}"'
    servo = f'kp="{gains["kp"]}" kv="{gains["kd"]}" {force_range}'
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{setup.step}" integrator="discrete" solver="{setup.solver}" tolerance="{setup.tolerance}"
          cone="elliptic" impratio="{setup.impratio}" gravity="0 0 {-scenario["robot"]["gravity"]}">
    <flag island="disable"/></option>
  <worldbody>
    <geom type="plane" size="0 0 1" contype="1" conaffinity="0" condim="3" friction="{friction[0]} 0 0"
          priority="1" {contact}/>
    {"".join(_peg(peg, contact) for peg in scenario["scene"]["obstacles"])}
    {_chain(scenario)}
  </worldbody>
  <actuator>{"".join(f'<position joint="{axis}{i}" {servo}/>' for i in joints for axis in ("yaw", "pitch"))}</actuator>
</mujoco>"""


def _peg(peg: list[float], contact: str) -> str:
    radius, x, y = peg
    return (
        f'<geom type="capsule" pos="{x!r} {y!r} 0" size="{radius!r} {PEG_HEIGHT}" contype="1" conaffinity="0" '
        f'condim="1" priority="1" {contact}/>'
    )


def _chain(scenario: dict[str, Any]) -> str:
    """Nested bodies, x along the links and z up; that of link 1 has its origin at the CG, the others' at the joint."""
    robot = scenario["robot"]
    length, half, radius = robot["length"], robot["contact_half_length"], robot["radius"]
    inertia = f"{robot['roll_inertia']} {robot['inertia']} {robot['inertia']}"
    text = ""
    for i in reversed(range(robot["links"])):
        centre = 0.0 if i == 0 else length / 2
        text = f"""<body pos="{0.0 if i == 0 else length / 2 if i == 1 else length} 0 0">{_joints(i)}
          <inertial pos="{centre} 0 0" mass="{robot["mass"]!r}" diaginertia="{inertia}"/>
          <geom type="capsule" fromto="{centre - half} 0 0 {centre + half} 0 0" size="{radius}"
                contype="0" conaffinity="1"/>
          {text}</body>"""
    return text


def _joints(link: int) -> str:
    if link == 0:
        return "<freejoint/>"
    axes = (("yaw", "0 0 1"), ("pitch", "0 1 0"))
    return "".join(f'<joint name="{name}{link}" type="hinge" axis="{axis}"/>' for name, axis in axes)
