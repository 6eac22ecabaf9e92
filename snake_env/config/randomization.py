"""What differs from episode to episode."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from snake_env.config.noise import Noise
from snake_env.config.section import DEGREE, Section, core_defaults, deprecated_alias

Range = tuple[float, float]

_OFF = core_defaults("randomization")


@deprecated_alias("free_play", "backlash")
@dataclass(frozen=True)
class Randomization(Section):
    """What differs from episode to episode, after the discrepancies that the thesis lists (T 7.5.4).

    Each range ``(low, high)`` is drawn from uniformly, anew in each episode and for each robot. The defaults switch
    everything off.

    Args:
        friction: factor on both friction coefficients, 0 to 10.
        anisotropy: further factor on the coefficient across a link, 0 to 10.
        mass: factor on mass and inertia of all links, 0.1 to 10.
        torque_limit: factor on the largest torque of a joint, 0.01 to 10.
        reference_rate: how often the joint references take over a new action [Hz], 0.1 to once a control period;
            None: in every one.
        reference_delay: time from an action to its effect on the references [s], rounded to control periods,
            0 to 10 and at most 100 periods.
        noise: amplitudes of uniform noise on what is observed, drawn anew in each step; see :meth:`Noise.table_7_4`.
        peg_error: largest error of the position of a located peg [m], the same for an episode, 0 to 1.
        backlash: backlash of all joints beyond the robot's own [rad], 0 to pi/2 with it; see :class:`Robot`.
        stribeck: drop of friction in sliding beyond the ground's own, 0 to 1 with it; see :class:`Stribeck`.
    """

    _section = "randomization"

    friction: Range = _OFF.friction
    anisotropy: Range = _OFF.anisotropy
    mass: Range = _OFF.mass
    torque_limit: Range = _OFF.torque_limit
    reference_rate: float | None = None
    reference_delay: Range = _OFF.reference_delay
    noise: Noise | Mapping[str, float] = dataclasses.field(default_factory=Noise)
    peg_error: float = _OFF.peg_error
    backlash: Range = _OFF.backlash
    stribeck: Range = _OFF.stribeck

    def __post_init__(self) -> None:
        if isinstance(self.noise, Mapping):
            object.__setattr__(self, "noise", Noise.of(self.noise, "randomization.noise"))
        super().__post_init__()

    @classmethod
    def thesis(cls) -> Randomization:
        """Everything at once. Worn varnish, a tenth of the mass, motors that saturate, references at 10 Hz that come 50
        to 150 ms late. Sensors of (T Table 7.4) (b) without its error of 10 cm in position, pegs 1 cm off. Joints with
        3 to 5 degrees of backlash, friction that falls by up to 30 % in sliding.
        """
        turn = 0.1 * DEGREE
        return cls(
            friction=(0.75, 1.25),
            anisotropy=(0.8, 1.25),
            mass=(0.9, 1.1),
            torque_limit=(0.6, 1.0),
            reference_rate=10.0,
            reference_delay=(0.05, 0.15),
            noise=Noise(heading=turn, joint_angle=turn, velocity=0.1, yaw_rate=turn, joint_rate=turn),
            peg_error=0.01,
            backlash=(3 * DEGREE, 5 * DEGREE),
            stribeck=(0.0, 0.3),
        )
