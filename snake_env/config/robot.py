"""The chain of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.config.section import DEGREE, Section, core_defaults, deprecated_alias

PerLink = float | Sequence[float]

_AIKO = core_defaults("robot")


@deprecated_alias("free_play", "backlash")
@dataclass(frozen=True)
class Robot(Section):
    """A chain of rigid links; the default is Aiko (T Table 7.1).

    Every quantity except ``links``, ``gravity``, ``backlash``, ``self_contact``, ``joint_limit``, ``locked`` and
    ``limp`` is a number for all links or a sequence, one per link.

    Args:
        links: number of links n >= 2.
        length: distance between adjacent joints L_i [m], > 0.
        contact_half_length: half length of the straight sides of a link's outline L_GS,i [m], >= 0.
        radius: half width of a link and radius of its round ends L_SC,i [m], > 0.
        mass: m_i [kg], > 0.
        inertia: moment of inertia about an axis across the link through the CG, Theta_psi [kg m^2], > 0.
        roll_inertia: moment of inertia about the link's centre line, Theta_rho [kg m^2], > 0; the spatial model only.
        gravity: acceleration of gravity [m/s^2], > 0.
        self_contact: whether links that are not neighbours touch each other, or pass through each other as in the
            thesis; None: True in the planar and the spatial model with the method "implicit".
        joint_limit: largest angle of a joint to either side [rad], > 0, ``inf`` for none; None: a right angle in the
            planar and the spatial model with the method "implicit", none elsewhere. In the spatial model it limits yaw
            and pitch.
        backlash: angle by which a joint can turn while its motor stands still (T 7.5.4) [rad], 0 to pi/2; Aiko has 3
            to 5 degrees. Not in the minimal model, with the method "thesis" nor with :class:`IOLinearizing`.
        locked: joints that keep the angle of the start, numbered from 0 as in ``joint_angle``: springs of 1e9 N m/rad
            hold them within 1e-9 rad per N m whatever their torque, with neither play nor torque limit, and without
            drift. With the method "implicit", set-valued friction and :class:`PD` only. In environments actions do not
            move them.
        limp: joints without an actuator, numbered likewise; the same holds.
    """

    _section = "robot"

    links: int = _AIKO.links
    length: PerLink = _AIKO.length
    contact_half_length: PerLink = _AIKO.contact_half_length
    radius: PerLink = _AIKO.radius
    mass: PerLink = _AIKO.mass
    inertia: PerLink = _AIKO.inertia
    roll_inertia: PerLink = _AIKO.roll_inertia
    gravity: float = _AIKO.gravity
    backlash: float = _AIKO.backlash
    self_contact: bool | None = _AIKO.self_contact
    joint_limit: float | None = _AIKO.joint_limit
    locked: Sequence[int] = _AIKO.locked
    limp: Sequence[int] = _AIKO.limp

    @classmethod
    def aiko(cls, **changes: Any) -> Robot:
        """Aiko as it was built: (T Table 7.1) and joints with 4 degrees of backlash (T 7.5.4); keywords replace these.

        Not in the minimal model. Its 10 references per second are ``simulate(reference_rate=10)``, its motors
        :meth:`PD.aiko`.
        """
        return cls(**({"backlash": 4 * DEGREE} | changes))


def per_link(value: PerLink, links: int) -> NDArray[np.float64]:
    """A quantity of each link (links,)."""
    return np.broadcast_to(np.asarray(value, np.float64), (links,))
