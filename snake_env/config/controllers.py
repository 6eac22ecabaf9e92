"""Joint controllers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from snake_env import _native
from snake_env._encode import encode
from snake_env.config.section import Section
from snake_env.errors import ConfigError


@dataclass(frozen=True)
class _JointController(Section):
    """Gains, limit and treatment, and what each model takes of them."""

    _section = "controller"
    _law: ClassVar[str]

    kp: float
    kd: float
    torque_limit: float | None = None
    active_from: float = 0.0
    treatment: str | float = "implicit"

    def __post_init__(self) -> None:
        _native.check("feedback", encode(self._feedback(), self._section))

    def _for_core(self) -> dict[str, Any]:
        names = ("kp", "kd", "torque_limit", "active_from")
        return {"law": self._law, **{name: getattr(self, name) for name in names}}

    def _for_planar(self) -> dict[str, Any]:
        """The part of the planar and the spatial model; what they have not is refused."""
        if self.treatment != "implicit":
            raise ConfigError("controller.treatment", repr(self.treatment), '"implicit", or model="minimal"')
        return self._for_core()

    def _feedback(self) -> dict[str, Any]:
        """The controller of the minimal model."""
        return {**self._for_core(), "treatment": self.treatment}


@dataclass(frozen=True)
class PD(_JointController):
    """Joint controller tau = -k_P (phi_d - phi) - k_D (phi_d' - phi') (T 3.51), (T 7.8) with the other sign.

    Args:
        kp: k_P [N m/rad], >= 0.
        kd: k_D [N m s/rad], >= 0.
        torque_limit: largest torque of a joint [N m], > 0; None for none.
        active_from: the actuators are off before this time [s], >= 0.
        treatment: as for :class:`IOLinearizing`; the planar and the spatial model take "implicit" alone.
    """

    _law = "pd"

    kp: float = 800.0
    kd: float = 2.0


@dataclass(frozen=True)
class IOLinearizing(_JointController):
    """Input-output linearising joint controller (T 6.58), (T 6.60); the default gains are the thesis's (T Table 7.2).

    tau = M22_bar u + h2_bar - g2_bar, u = phi_d'' - K_D (phi' - phi_d') - K_P (phi - phi_d), with the smooth friction
    (T 6.21) at two points a link as the controller's model, whatever the plant's law; so it is in the planar model too.

    Args:
        kp: K_P [1/s^2], >= 0.
        kd: K_D [1/s], >= 0.
        torque_limit: largest torque of a joint [N m], > 0; None for none.
        active_from: the actuators are off before this time [s], >= 0.
        treatment: "implicit" computes the torque continuously, in a time step from the state at its end, without
            limit on the step (under noise from a measurement every 2.5e-4 s); "step" from the state at the start of
            the step, held over it (``Integrator.step``, here by default 2.5e-4 s); a number is a control period [s]
            over which torques are held.
    """

    _law = "io"

    kp: float = 4e5
    kd: float = 2.4e3

    @classmethod
    def for_period(cls, period: float, **changes: Any) -> IOLinearizing:
        """Critically damped gains K_D = 0.5 / T, K_P = K_D^2 / 4 for torques held over a control period T [s].

        Torques are held over the period unless ``treatment`` says otherwise.
        """
        if not (isinstance(period, float | int) and 0.0 < period < math.inf):
            raise ConfigError("controller.period", repr(period), "a finite number > 0")
        kd = 0.5 / period
        return cls(**({"kp": 0.25 * kd * kd, "kd": kd, "treatment": period} | changes))
