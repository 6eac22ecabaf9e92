"""The condition of Theorem 6.1: how fast a reference may be for the proof to hold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env import minimal
from snake_env.config import Gait

Array = NDArray[np.float64]

JOINTS = 10


class Bound(NamedTuple):
    """What (T 6.113) needs.

    Attributes:
        damping: smallest eigenvalue of M_V_bar over the postures (T 6.111).
        coupling: lambda_D_bar of (T 6.91).
        rate: largest admissible bound c on the norm of phi_d' [rad/s].
    """

    damping: float
    coupling: float
    rate: float


def bound(gait: Gait, postures: int = 100) -> Bound:
    """The bound over the postures of a gait, to which the error dynamics lead; all postures would lower it further."""
    damping, coupling = np.inf, np.zeros(JOINTS)
    for phi in gait.reference(_period(gait, postures), JOINTS)["angle"]:
        damping = min(damping, _smallest_damping(phi))
        coupling = np.maximum(coupling, _couplings(phi))
    total = float(coupling.sum())
    return Bound(damping, total, damping / (2.0 * total))


def _smallest_damping(phi: Array) -> float:
    """Of M_V_bar (T 6.108) at a posture."""
    plant = minimal.control_plant(phi, np.zeros(phi.size + 3))
    return float(np.linalg.eigvalsh(plant.M_V[:3, :3])[0])


def _couplings(phi: Array) -> Array:
    """lambda_D_Bj,max of (T 6.89) for each joint.

    Column j of C_P is D_Pj q' (T 6.74), so column k of D_Pj is column j of C_P at q' = e_k.
    """
    q = np.concatenate([np.zeros(3), phi])
    columns = np.stack([minimal.process_plant(q, unit).C for unit in np.eye(q.size)[:3]], axis=-1)
    blocks = -columns[:3, 3:, :].transpose(1, 0, 2)
    return np.linalg.eigvalsh(0.5 * (blocks + blocks.transpose(0, 2, 1)))[:, -1]


def reference_speed(gait: Gait) -> float:
    """Largest norm of phi_d' over a period [rad/s]."""
    return float(np.linalg.norm(gait.reference(_period(gait, 400), JOINTS)["rate"], axis=1).max())


def _period(gait: Gait, count: int) -> Array:
    return np.linspace(0.0, 2.0 * np.pi / gait.omega, count)
