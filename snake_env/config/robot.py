"""The chain of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from snake_env.config.section import Section, core_defaults

PerLink = float | Sequence[float]

_AIKO = core_defaults("robot")


@dataclass(frozen=True)
class Robot(Section):
    """A chain of rigid links; the default is Aiko (T Table 7.1).

    Every quantity except ``links``, ``gravity``, ``free_play`` and ``self_contact`` is a number for all links or a
    sequence, one per link.

    Args:
        links: number of links n >= 2.
        length: distance between adjacent joints L_i [m], > 0.
        contact_half_length: half length of the straight sides of a link's outline L_GS,i [m], >= 0.
        radius: half width of a link and radius of its round ends L_SC,i [m], > 0.
        mass: m_i [kg], > 0.
        inertia: moment of inertia about an axis across the link through the CG, Theta_psi [kg m^2], > 0.
        roll_inertia: moment of inertia about the link's centre line, Theta_rho [kg m^2], > 0; the spatial model only.
        gravity: acceleration of gravity [m/s^2], > 0.
        self_contact: whether links that are not neighbours touch each other instead of passing through each other. The
            planar model only, not with the method "thesis".
        free_play: angle by which a joint can turn while its motor stands still (T 7.5.4) [rad], 0 to pi/2; Aiko has 3
            to 5 degrees. The planar model only, not with the method "thesis" nor with :class:`IOLinearizing`.
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
    free_play: float = _AIKO.free_play
    self_contact: bool = _AIKO.self_contact
