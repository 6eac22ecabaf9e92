"""The planar snake as a MuJoCo model, in the set-up in which MuJoCo does best here.

Integrator ``discrete`` (implicit in the servo's stiffness and damping), elliptic cones, pegs as spheres that capsules
touch without friction. Ground friction is a contact under each CG with a plane, of a sphere, or where friction differs
along and across the links of the lower end of a steep capsule, whose axis turns the tangents of the contact with it.
The robot has no vertical freedom, so the penetration is constant and is calibrated until the normal force is m g. It
stays m g in motion because the floor's inverse weight exceeds the links' so much that their posture does not count,
and because friction is so much harder than the normal contact that its residual does not add to the normal force.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

IMPRATIO = 1e8
"""Friction is this much harder than the normal contact."""
FLOOR_INVERSE_WEIGHT = 1e3
"""Of the floor's body [1/kg], against about 1 / kg of a link."""
SOFTEST = 1e-4
"""Smallest impedance that MuJoCo admits."""
GROUND_STIFFNESS = 1e2
FRICTION_DAMPING = 1e4
SPHERE = 1e3
"""Radius of the spheres under the CGs [m]: any, as long as it is larger than the penetration."""
STIFF, DEFAULT = "0.99 0.9999 1e-4", "0.9 0.95 1e-3"
"""Impedances of a contact: near rigid, and MuJoCo's default."""


@dataclass(frozen=True)
class Setup:
    """What a run may choose.

    Attributes:
        step: time step [s].
        tolerance: of the constraint solver.
        peg_time: time constant of a peg contact [s]; below the step MuJoCo takes the stiffest that does not rebound.
        peg_impedance: of a peg contact.
        solver: "CG" or "Newton".
    """

    step: float
    tolerance: float = 1e-8
    peg_time: float = 1e-4
    peg_impedance: str = STIFF
    solver: str = "CG"


def build(scenario: dict[str, Any], setup: Setup) -> mujoco.MjModel:
    """The model of a scenario of ``snake-bench``, every link pressed to the ground by its weight."""
    links, weight = scenario["robot"]["links"], scenario["robot"]["mass"] * scenario["robot"]["gravity"]
    depth = np.full(links, 1.0)
    for _ in range(4):
        model = _compiled(scenario, setup, depth)
        data = placed(model, scenario)
        data.ctrl[:] = scenario["joint_angle"]
        depth *= weight / normal_force(model, data)
    return _compiled(scenario, setup, depth)


def _compiled(scenario: dict[str, Any], setup: Setup, depth: NDArray[np.float64]) -> mujoco.MjModel:
    model = mujoco.MjModel.from_xml_string(_document(scenario, setup, depth))
    model.body_invweight0[model.body("floor").id] = FLOOR_INVERSE_WEIGHT
    return model


def placed(model: mujoco.MjModel, scenario: dict[str, Any]) -> mujoco.MjData:
    """The robot at rest at its start."""
    data = mujoco.MjData(model)
    data.qpos[2] = scenario["start"][2]
    data.qpos[3:] = scenario["joint_angle"]
    return data


def normal_force(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Force of the ground on each link [N]."""
    mujoco.mj_forward(model, data)
    force, wrench = np.zeros(model.nu + 1), np.zeros(6)
    for k, contact in enumerate(data.contact):
        if contact.dim == 3:
            mujoco.mj_contactForce(model, data, k, wrench)
            name = model.geom(max(contact.geom)).name
            force[int(name.removeprefix("ground"))] = wrench[0]
    return force


def _document(scenario: dict[str, Any], setup: Setup, depth: NDArray[np.float64]) -> str:
    friction = scenario["scene"]["friction"]
    links = range(scenario["robot"]["links"])
    limit = scenario["controller"]["torque_limit"]
    gains = f'kp="{scenario["controller"]["kp"]}" kv="{scenario["controller"]["kd"]}"'
    force_range = "" if limit is None else f'forcerange="{-limit} {limit}"'
    ground = (
        f'condim="3" friction="{friction[0]} {friction[1]} 0 0 0" solref="{-GROUND_STIFFNESS} -1" '
        f'solreffriction="-1 {-FRICTION_DAMPING}" solimp="{SOFTEST} {SOFTEST} 1"'
    )
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{setup.step}" integrator="discrete" solver="{setup.solver}" tolerance="{setup.tolerance}"
          cone="elliptic" impratio="{IMPRATIO}" gravity="0 0 0"><flag island="disable"/></option>
  <worldbody>
    <body name="floor"><geom name="floor" type="plane" size="0 0 1" pos="0 0 {-SPHERE}" contype="0" conaffinity="0"/>
    </body>
    {"".join(_peg(peg, setup) for peg in scenario["scene"]["obstacles"])}
    {_chain(scenario, depth)}
  </worldbody>
  <contact>{"".join(f'<pair geom1="ground{i}" geom2="floor" {ground}/>' for i in links)}</contact>
  <actuator>{"".join(f'<position joint="joint{i}" {gains} {force_range}/>' for i in links[1:])}</actuator>
</mujoco>"""


def _peg(peg: list[float], setup: Setup) -> str:
    radius, x, y = peg
    return (
        f'<geom type="sphere" pos="{x!r} {y!r} 0" size="{radius!r}" contype="1" conaffinity="0" condim="1" '
        f'solref="{setup.peg_time} 1" solimp="{setup.peg_impedance}" priority="1"/>'
    )


def _chain(scenario: dict[str, Any], depth: NDArray[np.float64]) -> str:
    """Nested bodies; that of link 1 has its origin at the CG, those of the others at the joint before them."""
    robot = scenario["robot"]
    length, half, radius = robot["length"], robot["contact_half_length"], robot["radius"]
    mass, inertia = robot["mass"], robot["inertia"]
    along, across = scenario["scene"]["friction"]
    text = ""
    for i in reversed(range(robot["links"])):
        centre = 0.0 if i == 0 else length / 2
        place = (
            f"{scenario['start'][0]!r} {scenario['start'][1]!r}" if i == 0 else f"{length / 2 if i == 1 else length} 0"
        )
        steep = f'type="capsule" fromto="{centre} 0 0 {centre + 1} 0 {SPHERE}"'
        foot = f'type="sphere" pos="{centre} 0 0"' if along == across else steep
        text = f"""<body pos="{place} 0">{_joints(i)}
          <inertial pos="{centre} 0 0" mass="{mass!r}" diaginertia="{inertia} {inertia} {inertia}"/>
          <geom type="capsule" fromto="{centre - half} 0 0 {centre + half} 0 0" size="{radius}"
                contype="0" conaffinity="1" condim="1"/>
          <geom name="ground{i}" {foot} size="{SPHERE + float(depth[i])!r}" contype="0" conaffinity="0"/>
          {text}</body>"""
    return text


def _joints(link: int) -> str:
    if link > 0:
        return f'<joint name="joint{link}" type="hinge" axis="0 0 1"/>'
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0"))
    return slides + '<joint type="hinge" axis="0 0 1"/>'
