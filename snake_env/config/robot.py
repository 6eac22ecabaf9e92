"""The chain of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from snake_env import _checks
from snake_env.config.section import Section

PerLink = float | Sequence[float]


@dataclass(frozen=True)
class Robot(Section):
    """A chain of rigid links; the default is Aiko (T Table 7.1).

    Every quantity but ``links``, ``gravity`` and ``free_play`` is one number for all links or a sequence of one a link.

    Args:
        links: number of links n >= 2.
        length: distance between adjacent joints L_i [m], > 0.
        contact_half_length: half length of the straight sides of a link's outline L_GS,i [m], >= 0.
        radius: half width of a link and radius of its round ends L_SC,i [m], > 0.
        mass: m_i [kg], > 0.
        inertia: moment of inertia about an axis across the link through the CG, Theta_psi [kg m^2], > 0.
        roll_inertia: moment of inertia about the link's centre line, Theta_rho [kg m^2], > 0; the spatial model alone.
        gravity: acceleration of gravity [m/s^2], > 0.
        free_play: angle by which a joint can turn while its motor stands still (T 7.5.4) [rad], 0 to pi/2; Aiko has 3
            to 5 degrees. The planar model alone, not with the method "thesis" nor with :class:`IOLinearizing`.
    """

    _section = "robot"

    links: int = 11
    length: PerLink = 0.122
    contact_half_length: PerLink = 0.0393
    radius: PerLink = 0.0525
    mass: PerLink = 7.5 / 11.0
    inertia: PerLink = 1.32e-3
    roll_inertia: PerLink = 9.40e-4
    gravity: float = 9.81
    free_play: float = 0.0

    def __post_init__(self) -> None:
        _checks.links(self.links)
        super().__post_init__()
