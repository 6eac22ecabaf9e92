"""The minimal model (T ch. 6), there "robot model", in matrices, for people: named arrays at one state.

The simulation itself needs none of these (``snake_env.simulate(model="minimal")``); they are what the thesis prints.
n is the number of degrees of freedom, links + 2; link and joint numbers count from 0.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env import _checks
from snake_env._native import control_plant as native_control_plant
from snake_env._native import process_plant as native_process_plant
from snake_env.config import PD, Robot, Scene
from snake_env.config.section import core_defaults

Array = NDArray[np.float64]

_GROUND = core_defaults("scene", "minimal")
_PD = core_defaults("controller", "minimal")

TABLE_7_2_GROUND = Scene(friction=_GROUND.friction, viscous=_GROUND.viscous)
"""The ground of (T Table 7.2), with set-valued friction."""

TABLE_7_2_PD = PD(kp=_PD.kp, kd=_PD.kd)
"""The PD controller of (T Table 7.2)."""

GROUND = dataclasses.replace(TABLE_7_2_GROUND, friction_law="arctan")
"""The same ground with the printed smooth friction (T 6.21)."""


class ProcessPlant(NamedTuple):
    """M q'' + C q' = P_phi tau + friction, q = (x_O2, y_O2, theta, phi) (T 6.14); vectors in frame I.

    Attributes:
        M: (n, n) mass matrix (T 6.15).
        C: (n, n) Coriolis and centripetal matrix (T 6.16), with Mdot - 2 C skew.
        J_G: (links, 2, n) Jacobians of the centres of gravity (T 6.5).
        J_F: (links, 2, n) of the front contact points (T 6.11).
        J_R: (links, 2, n) of the rear contact points.
        F_F: (links, 2) friction at the front contact points (T 6.19) [N].
        F_R: (links, 2) at the rear ones [N].
        friction: (n,) sum of J_F^T F_F + J_R^T F_R.
    """

    M: Array
    C: Array
    J_G: Array
    J_F: Array
    J_R: Array
    F_F: Array
    F_R: Array
    friction: Array


class ControlPlant(NamedTuple):
    """M nu' + h = g + P_phi tau, nu = (v_O2 in frame B_3, theta', phi') (T 6.37); vectors in frame B_3.

    Attributes:
        M: (n, n) mass matrix (T 6.38).
        C: (n, n) (T 6.39).
        J_F: (links, 2, n) Jacobians of the front contact points (T 6.32).
        J_R: (links, 2, n) of the rear ones (T 6.33).
        F_F: (links, 2) friction at the front contact points (T 6.40) [N].
        F_R: (links, 2) at the rear ones [N].
        M11: (3, 3), M12: (3, n - 3), M21: (n - 3, 3), M22: (n - 3, n - 3) blocks of M (T 6.52).
        h: (n,) C nu (T 6.43).
        g: (n,) generalised friction (T 6.44).
        M_V: (n, n): -M_V nu is the generalised viscous friction (T 6.102), (T A.7).
        M22_bar: (n - 3, n - 3) M22 - M21 M11^-1 M12 (T 6.55).
        h2_bar: (n - 3,) (T 6.56).
        g2_bar: (n - 3,) (T 6.57).
    """

    M: Array
    C: Array
    J_F: Array
    J_R: Array
    F_F: Array
    F_R: Array
    M11: Array
    M12: Array
    M21: Array
    M22: Array
    h: Array
    g: Array
    M_V: Array
    M22_bar: Array
    h2_bar: Array
    g2_bar: Array


def process_plant(q: ArrayLike, qdot: ArrayLike, robot: Robot | None = None, scene: Scene = GROUND) -> ProcessPlant:
    """The process plant at coordinates ``q`` and velocities ``qdot``, (n,) each.

    Raises:
        ConfigError: names the field, the value and what is admissible.
    """
    return ProcessPlant(**native_process_plant(_state({"q": q, "qdot": qdot}, robot, scene)))


def control_plant(phi: ArrayLike, nu: ArrayLike, robot: Robot | None = None, scene: Scene = GROUND) -> ControlPlant:
    """The control plant at joint angles ``phi``, (n - 3,), and velocities ``nu``, (n,).

    Raises:
        ConfigError: names the field, the value and what is admissible.
    """
    return ControlPlant(**native_control_plant(_state({"phi": phi, "nu": nu}, robot, scene)))


def _state(vectors: dict[str, ArrayLike], robot: Robot | None, scene: Scene) -> dict[str, Any]:
    arrays = {name: np.atleast_1d(_checks.reals(name, vector)) for name, vector in vectors.items()}
    return {"robot": Robot.of(robot), "scene": Scene.of(scene), **arrays}
