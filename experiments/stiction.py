"""Does what friction must hold stay where it is? This simulator and MuJoCo, from its defaults to its no-slip solver.

    python -m experiments.stiction             # a quarter of an hour
    python -m experiments.stiction --hour 60

The robot lies on a slope of ground with mu = 0.3, straight or in the posture of the gait, held by its servos; or two
links brace themselves between rough walls, along which gravity acts. The capsule between pads is the scene of MuJoCo's
issue 3328, rebuilt. Prints a table in Markdown.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from experiments.stiction_cases import MU, SERVO, WALL_MU, Case, braced, resting, straight
from snake_env import Integrator, simulate
from snake_env.markdown import table
from training.cli import answer
from training.config import Positive

Array = NDArray[np.float64]

GRAVITY = 9.81
SETTLED, UNTIL = 1.0, 11.0
"""Between these times [s] speeds are measured."""
STEP = 0.002
"""MuJoCo's default time step [s]."""
ELLIPTIC = {"cone": mujoco.mjtCone.mjCONE_ELLIPTIC, "impratio": 1e3, "tolerance": 1e-10}
SETTINGS: dict[str, dict[str, Any] | None] = {
    "MuJoCo, default contacts": {"cone": mujoco.mjtCone.mjCONE_PYRAMIDAL, "impratio": 1.0, "tolerance": 1e-8},
    "elliptic, impratio 10": ELLIPTIC | {"impratio": 10.0},
    "elliptic, impratio 1000": ELLIPTIC,
    "and noslip": ELLIPTIC | {"noslip_iterations": 3},
    "`to_mjcf`": None,
}
"""Options of MuJoCo with its default contacts; None: contacts and options as exported."""


@dataclass
class Options:
    """What is measured.

    Args:
        hour: Time for which the robot lies at rest [s].
    """

    hour: Positive = 3600.0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, _run, __doc__, arguments)


def _run(options: Options) -> int:
    half, below, above = (straight(share) for share in (0.5, 0.999, 1.001))
    rest = resting()
    last = max(options.hour, 2 * SETTLED)
    rows: list[tuple[str, Callable[[str], str]]] = [
        ("half the critical slope [um/s]", lambda who: f"{creep(who, half):.2g}"),
        ("0.999 of it [um/s]", lambda who: f"{creep(who, below):.2g}"),
        ("1.001 of it: sliding friction over mu N", lambda who: f"{sliding(who, above):.4f}"),
        ("two links between walls [um/s]", lambda who: f"{creep(who, braced()):.2g}"),
        ("capsule between pads [um/s]", lambda who: f"{pinched(chosen):.2g}" if (chosen := SETTINGS.get(who)) else "-"),
        (f"{options.hour:g} s at rest on half the slope [mm]", lambda who: f"{moved(who, rest, last):.2g}"),
    ]
    names = ("plane", "3D", *SETTINGS)
    found = []
    for label, measure in rows:
        found.append([label, *(measure(name) for name in names)])
        print(*found[-1], file=sys.stderr, flush=True)
    print(table(["", *names], found))
    return 0


def creep(who: str, case: Case) -> float:
    """Speed of the fastest link [um/s]."""
    before, after = positions(who, case, (SETTLED, UNTIL))
    return float(1e6 * np.linalg.norm(after - before, axis=-1).max() / (UNTIL - SETTLED))


def sliding(who: str, case: Case) -> float:
    """Friction of the sliding robot over that of Coulomb."""
    first, middle, last = (at[:, 0].mean() for at in positions(who, case, (SETTLED, (SETTLED + UNTIL) / 2, UNTIL)))
    angle = case.scene.slope[0]
    acceleration = (first - 2.0 * middle + last) / (0.5 * (UNTIL - SETTLED)) ** 2
    return float((acceleration / GRAVITY + np.sin(angle)) / (MU * np.cos(angle)))


def moved(who: str, case: Case, last: float) -> float:
    """How far the link that moves most has gone since it settled [mm]."""
    before, after = positions(who, case, (SETTLED, last))
    return float(1e3 * np.linalg.norm(after - before, axis=-1).max())


def positions(who: str, case: Case, times: tuple[float, ...]) -> list[Array]:
    """CGs (n, 2) of the links at these multiples of the first one."""
    if who in SETTINGS:
        return peer_positions(SETTINGS[who], case, times)
    # At the default step the planar links creep within the tolerance of the solver.
    fine = Integrator(step=1e-3) if who == "plane" and case.scene.obstacles else None
    run = simulate(
        model="planar" if who == "plane" else "spatial",
        robot=case.robot,
        scene=case.scene,
        gait=case.target,
        controller=SERVO,
        integrator=fine,
        start=case.start,
        duration=times[-1],
        sample=times[0],
    )
    return [run.position[round(time / times[0]), :, :2] for time in times]


def peer_positions(options: dict[str, Any] | None, case: Case, times: tuple[float, ...]) -> list[Array]:
    """Those of MuJoCo, whose servos need ``implicitfast``: with its default, Euler, they are unstable at this step."""
    text = case.scene.to_mjcf(case.robot, SERVO, case.start, case.target, STEP)
    model = mujoco.MjModel.from_xml_string(text)
    if options is not None:
        model.geom_solref[:] = mujoco.MjModel.from_xml_string(PADS).geom_solref[0]
        choose(model, options)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    joints = case.robot.links - 1
    data.ctrl[::2] = case.target.reference(np.zeros(1), joints, False)["angle"][0]
    found = []
    for time in times:
        mujoco.mj_step(model, data, round((time - data.time) / STEP))
        mujoco.mj_kinematics(model, data)
        found.append(data.xipos[1:, :2].copy())
    return found


def choose(model: mujoco.MjModel, options: dict[str, Any]) -> None:
    """Sets these options of a model."""
    for name, value in options.items():
        setattr(model.opt, name, value)


PADS = f"""
<mujoco><option timestep="{STEP}"/><worldbody>
  <body pos="-0.0125 0 0"><joint name="left" type="slide" axis="1 0 0" damping="100"/>
    <geom type="box" size="0.008 0.03 0.02" mass="0.2" friction="{WALL_MU}"/></body>
  <body pos="0.0125 0 0"><joint name="right" type="slide" axis="-1 0 0" damping="100"/>
    <geom type="box" size="0.008 0.03 0.02" mass="0.2" friction="{WALL_MU}"/></body>
  <body name="rod"><freejoint/>
    <geom type="capsule" size="0.004 0.02" euler="90 0 0" mass="0.045" friction="{WALL_MU}"/></body>
</worldbody><actuator><position joint="left" kp="6000"/><position joint="right" kp="6000"/></actuator></mujoco>"""
"""A capsule of 45 g between pads that press it with 5 N each and more, over ten times what holds its weight."""


def pinched(options: dict[str, Any]) -> float:
    """Speed at which the capsule sinks [um/s]."""
    model = mujoco.MjModel.from_xml_string(PADS)
    choose(model, options)
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.0025  # 2 mm beyond the first contact
    mujoco.mj_step(model, data, round(0.5 / STEP))
    before = data.body("rod").xpos[2]
    mujoco.mj_step(model, data, round(2.0 / STEP))
    return float(1e6 * abs(data.body("rod").xpos[2] - before) / 2.0)


if __name__ == "__main__":
    sys.exit(main())
