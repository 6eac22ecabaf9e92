"""Where a robot starts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from snake_env import _checks
from snake_env.config.scene import Scene, course
from snake_env.config.section import Section, core_defaults, freeze
from snake_env.errors import ConfigError

_AT_REST = core_defaults("start")
_POSITION = "(x, y) or (x, y, z)"
_POSTURE = '"gait", "straight" or a joint angle for each joint, in 3D also (yaw, pitch)'


@dataclass(frozen=True)
class Start(Section):
    """Where the robot starts, at rest. What depends on model and robot is checked when they are known.

    Args:
        position: CG of link 1 (x, y) [m]; of the first real link in the minimal model. In the spatial model
            also (x, y, z); without z the robot rests on the ground.
        heading: absolute angle theta_1 of link 1 [rad]; with pi the body axes point to -x and the
            leading link faces +x. In the spatial model the yaw of its centre line.
        posture: "gait" (joint angles equal the reference at t = 0), "straight", or n - 1 joint angles [rad]. In the
            spatial model also n - 1 pairs (yaw, pitch). That of a single hinge has one angle and a 0: its pitch where
            its axis is nearest to pitch, else its yaw.
        pitch: lifts the chain behind link 1, which then faces down [rad], in [-pi/2, pi/2]; the spatial model only. The
            pitch of a joint has the opposite sign: it lowers the links behind the joint.
        roll: turns the chain about the centre line of link 1, its left side down [rad]; the spatial model only. None
            is 0, but -pi/2, on its side, for a gait that also yaws and whose posture bends only up and down, as
            lateral rolling's.
    """

    _section = "start"

    position: tuple[float, float] | tuple[float, float, float] = _AT_REST.position
    heading: float = _AT_REST.heading
    posture: str | Sequence[float] | Sequence[tuple[float, float]] = _AT_REST.posture
    pitch: float = _AT_REST.pitch
    roll: float | None = _AT_REST.roll

    def __post_init__(self) -> None:
        freeze(self)
        if _checks.reals("start.position", self.position, _POSITION).shape not in [(2,), (3,)]:
            raise ConfigError("start.position", repr(self.position), _POSITION)
        _checks.number("start.heading", self.heading)
        _checks.number("start.pitch", self.pitch, -math.pi / 2, math.pi / 2)
        if self.roll is not None:
            _checks.number("start.roll", self.roll)
        if not (isinstance(self.posture, str) and self.posture in ("gait", "straight")):
            angles = _checks.reals("start.posture", self.posture, _POSTURE)
            if angles.ndim not in (1, 2) or angles.shape[1:] not in [(), (2,)]:
                raise ConfigError("start.posture", repr(self.posture), _POSTURE)

    @classmethod
    def on_course(cls, scene: Scene, model: str = "planar") -> Start:
        """The start from which the robot in the posture of the gait threads a preset course, ready to move to +x.

        Args:
            scene: made by :meth:`Scene.preset`.
            model: "planar" or "spatial"; friction acts elsewhere in the latter, so its starts differ by centimetres.
        """
        _checks.choice("model", model, ("planar", "spatial"))
        if not isinstance(scene, Scene):
            raise ConfigError("scene", repr(scene), "a snake_env.Scene made by Scene.preset")
        if scene.course is None:
            raise ConfigError("scene.course", None, "a scene made by Scene.preset")
        x, y, heading = course(scene.course)["start" if model == "planar" else "spatial_start"]
        return cls(position=(x, y), heading=heading)
