"""Joint controllers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from snake_env import _checks
from snake_env.config.section import Section, core_defaults

_PD = core_defaults("controller")
_IO = core_defaults("io_controller")


@dataclass(frozen=True)
class PD(Section):
    """Joint controller tau = -k_P (phi_d - phi) - k_D (phi_d' - phi') (T 3.51), (T 7.8) with the other sign.

    Args:
        kp: k_P [N m/rad], >= 0.
        kd: k_D [N m s/rad], >= 0.
        torque_limit: largest torque of a joint [N m], > 0; None for none.
        active_from: the actuators are off before this time [s], >= 0.
        treatment: as for :class:`IOLinearizing`; the planar and the spatial model take "implicit" only.
    """

    _section = "controller"

    kp: float = _PD.kp
    kd: float = _PD.kd
    torque_limit: float | None = _PD.torque_limit
    active_from: float = _PD.active_from
    treatment: str | float = _PD.treatment
    law: str = field(default="pd", init=False, repr=False)

    @classmethod
    def aiko(cls, **changes: Any) -> PD:
        """Aiko's joints: P control and motors that saturate (T 7.4), (T 7.5.4); keywords replace these values.

        The thesis gives neither gain nor torque. k_P = 50 N m/rad and 5 N m are estimates. The lifted links of
        sidewinding then sag by some degrees, and the course of Table 7.5 needs up to 5 N m.
        """
        return cls(**({"kp": 50.0, "kd": 0.0, "torque_limit": 5.0} | changes))


@dataclass(frozen=True)
class IOLinearizing(Section):
    """Input-output linearising joint controller (T 6.58), (T 6.60); the default gains are the thesis's (T Table 7.2).

    tau = M22_bar u + h2_bar - g2_bar, with u = phi_d'' - K_D (phi' - phi_d') - K_P (phi - phi_d). The controller's
    model is the smooth friction (T 6.21) at two points per link, whatever the plant's law, in the planar model too.

    Args:
        kp: K_P [1/s^2], >= 0.
        kd: K_D [1/s], >= 0.
        torque_limit: largest torque of a joint [N m], > 0; None for none.
        active_from: the actuators are off before this time [s], >= 0.
        treatment: "implicit": the torque follows from the state at the end of a time step, without limit on the step.
            Under noise it follows from a measurement every 2.5e-4 s. "step": from the state at its start, held over it
            (``Integrator.step``, here by default 2.5e-4 s). A number: a control period [s] over which torques are held.
    """

    _section = "controller"

    kp: float = _IO.kp
    kd: float = _IO.kd
    torque_limit: float | None = _IO.torque_limit
    active_from: float = _IO.active_from
    treatment: str | float = _IO.treatment
    law: str = field(default="io", init=False, repr=False)

    @classmethod
    def for_period(cls, period: float, **changes: Any) -> IOLinearizing:
        """Critically damped gains K_D = 0.5 / T, K_P = K_D^2 / 4 for torques held over a control period T [s].

        Torques are held over the period unless ``treatment`` says otherwise.
        """
        period = _checks.positive("controller.period", period)
        kd = 0.5 / period
        return cls(**({"kp": 0.25 * kd * kd, "kd": kd, "treatment": period} | changes))
