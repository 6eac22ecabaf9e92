"""The motor of a joint axis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from snake_env.config.section import Section, core_defaults

_NONE = core_defaults("motor")


@dataclass(frozen=True)
class Motor(Section):
    """A motor with its gear, on every joint axis or on one.

    Driving, it gives at most ``stall_torque (1 - |rate| / no_load_speed)``, beyond the no-load speed nothing. Braking,
    it gives up to ``stall_torque``. It never gives more than the controller's ``torque_limit``. Up to the no-load speed
    it is an ideal DC motor, which draws the mechanical power and the heat ``torque^2 no_load_speed / stall_torque``. It
    draws nothing where it would give energy back. The inertia of the rotor, times ``gear_ratio^2``, resists changes of
    the joint's rate. The friction of the gear obeys Coulomb's law with a constant bound: a load below it does not turn
    the gear back. ``Motor()`` changes nothing.

    Args:
        stall_torque: torque at the joint when it does not turn [N m], > 0; ``inf``: whatever the controller asks for.
        no_load_speed: rate of the joint at which a motor with a stall torque gives no torque any more [rad/s], > 0.
            ``inf``: the torque does not fall, and the motor has no heat.
        rotor_inertia: moment of inertia of the rotor, before the gear [kg m^2], >= 0.
        gear_friction: torque at the joint that the friction of the gear resists with [N m], >= 0. With rotor inertia,
            gear friction or gear damping a robot has no backlash.
        gear_ratio: turns of the rotor in one of the joint, > 0.
        gear_damping: viscous friction of the gear, at the joint [N m s/rad], >= 0.
    """

    _section = "motor"

    stall_torque: float = _NONE.stall_torque
    no_load_speed: float = _NONE.no_load_speed
    rotor_inertia: float = _NONE.rotor_inertia
    gear_friction: float = _NONE.gear_friction
    gear_ratio: float = _NONE.gear_ratio
    gear_damping: float = _NONE.gear_damping

    @classmethod
    def aiko(cls, **changes: Any) -> Motor:
        """A motor of 6 W, of which Aiko has two in every cardan joint (T 7.4); keywords replace these values.

        Assumed: 6 W is the largest mechanical power, a quarter of stall torque times no-load speed. The stall torque
        is the 5 N m of :meth:`PD.aiko`, which leaves 4.8 rad/s. Rotor and gear are not known and left out.
        """
        return cls(**({"stall_torque": 5.0, "no_load_speed": 4.8} | changes))

    @classmethod
    def xh430(cls, **changes: Any) -> Motor:
        """ROBOTIS DYNAMIXEL XH430-W350 at 12 V; keywords replace these values.

        From its e-manual: stall torque 3.4 N m, no-load speed 30 rev/min, gear ratio 353.5. Assumed: the torque falls
        linearly from the stall torque on. Inertia of the rotor and friction of the gear are not published, so left out,
        and the motor draws less at stall than the servo.
        """
        return cls(**({"stall_torque": 3.4, "no_load_speed": 30 * math.tau / 60, "gear_ratio": 353.5} | changes))
