"""What a user may choose about a scripted run: frozen dataclasses, checked by the Rust core.

SI units and radians. A value that is not admissible raises :class:`snake_env.ConfigError` at construction.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snake_env import _checks, _native
from snake_env._encode import encode
from snake_env.errors import ConfigError

DEGREE = math.pi / 180.0
PerLink = float | Sequence[float]


class _Section:
    """A part of the configuration: one JSON object of the core, checked when it is made."""

    _section: ClassVar[str]

    def __post_init__(self) -> None:
        _native.check(self._section, encode(self._for_core(), self._section))

    def _for_core(self) -> dict[str, Any]:
        """The fields that the core knows."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}  # type: ignore[arg-type]


@dataclass(frozen=True)
class Robot(_Section):
    """A chain of rigid links; the default is Aiko (T Table 7.1).

    Every quantity but ``links`` and ``gravity`` is one number for all links or a sequence of one a link.

    Args:
        links: number of links n >= 2.
        length: distance between adjacent joints L_i [m], > 0.
        contact_half_length: half length of the straight sides of a link's outline L_GS,i [m], >= 0.
        radius: half width of a link and radius of its round ends L_SC,i [m], > 0.
        mass: m_i [kg], > 0.
        inertia: moment of inertia about an axis across the link through the CG, Theta_psi [kg m^2], > 0.
        roll_inertia: moment of inertia about the link's centre line, Theta_rho [kg m^2], > 0; the spatial model alone.
        gravity: acceleration of gravity [m/s^2], > 0.
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


@dataclass(frozen=True)
class Scene(_Section):
    """Circular pegs fixed to the ground, and the ground's friction.

    Args:
        obstacles: pegs as triples (radius, x, y) [m]; radius > 0.
        friction: Coulomb coefficients along and across a link (mu_x, mu_y), >= 0.
        rolling_friction: coefficient mu_V of the friction that resists rolling (T 4.87), >= 0; the spatial model alone.
        viscous: viscous coefficients along and across a link (mu_Vx, mu_Vy) [s/m], >= 0; the robot model alone.
        friction_law: "set-valued", the exact Coulomb law; for the robot model also "arctan" (T 6.21), a box, and
            "ellipse", -D^2 v / sqrt(v^T D^2 v + eps^2) with D = diag(friction) times a contact point's normal force.
        smoothing: eps of the smooth laws, > 0: [m/s] for "arctan", [N m/s] for "ellipse".
        course: name of the preset that the scene was made from, for :meth:`Start.on_course`.
    """

    _section = "scene"

    obstacles: Sequence[tuple[float, float, float]] = ()
    friction: tuple[float, float] = (0.2, 0.2)
    rolling_friction: float = 0.02
    viscous: tuple[float, float] = (0.0, 0.0)
    friction_law: str = "set-valued"
    smoothing: float = 1e-3
    course: str | None = None

    def __post_init__(self) -> None:
        _checks.choice("scene.course", self.course, [None, *_native.courses()])
        super().__post_init__()
        _native.check("ground", encode(self._ground(), self._section))

    def _for_core(self) -> dict[str, Any]:
        names = ("obstacles", "friction", "rolling_friction")
        return {name: getattr(self, name) for name in names}

    def _for_planar(self) -> dict[str, Any]:
        """The part of the planar and the spatial model; what they have not is refused."""
        if any(self.viscous):
            raise ConfigError("scene.viscous", repr(self.viscous), '(0.0, 0.0), or model="minimal": viscous friction')
        if self.friction_law != "set-valued":
            raise ConfigError("scene.friction_law", repr(self.friction_law), '"set-valued", or model="minimal"')
        return self._for_core()

    def _ground(self) -> dict[str, Any]:
        """The ground of the robot model."""
        names = ("friction", "viscous", "friction_law", "smoothing")
        return {name: getattr(self, name) for name in names}

    @classmethod
    def preset(cls, name: str, friction: tuple[float, float] = (0.2, 0.2)) -> Scene:
        """A course of the thesis: "table-7.3", "table-7.5" or "free" (no obstacles)."""
        pegs = [tuple(peg) for peg in _course(name)["obstacles"]]
        return cls(obstacles=pegs, friction=friction, course=name)

    def without(self, j: int) -> Scene:
        """The scene without obstacle ``j`` (1-based, as in the thesis)."""
        k = self._index(j)
        return dataclasses.replace(self, obstacles=[*self.obstacles[:k], *self.obstacles[k + 1 :]])

    def moved(self, j: int, dx: float, dy: float) -> Scene:
        """The scene with obstacle ``j`` (1-based) shifted by (dx, dy) [m]."""
        k = self._index(j)
        radius, x, y = self.obstacles[k]
        shifted = (radius, x + dx, y + dy)
        return dataclasses.replace(self, obstacles=[*self.obstacles[:k], shifted, *self.obstacles[k + 1 :]])

    def _index(self, j: int) -> int:
        count = len(self.obstacles)
        if not 1 <= j <= count:
            raise ConfigError("obstacle", j, f"an integer in [1, {count}]")
        return j - 1


def _course(name: str) -> dict[str, Any]:
    courses = _native.courses()
    if not isinstance(name, str) or name not in courses:
        raise ConfigError("preset", repr(name), "one of " + ", ".join(f'"{key}"' for key in courses))
    return courses[name]


@dataclass(frozen=True)
class Gait(_Section):
    """Joint references: travelling waves, phi_i = A sin(omega t + (i - 1) beta) + gamma (T 2.14), (T 7.1).

    The spatial model has a vertical wave beside it, A_v sin(omega_v t + (i - 1) beta_v + beta_0) (T 2.15), (T 7.2). The
    others take the horizontal wave alone: their ``vertical_amplitude`` must be zero.

    Args:
        amplitude: A_h [rad].
        omega: omega_h [rad/s].
        beta: beta_h, phase shift between adjacent joints [rad].
        gamma: gamma_h, common offset that steers [rad].
        vertical_amplitude: A_v [rad] (T 7.2).
        vertical_omega: omega_v [rad/s].
        vertical_beta: beta_v [rad].
        vertical_phase: beta_0, phase of the vertical against the horizontal wave [rad].
        soft_start: each joint waits at zero until its reference first comes within 3 degrees (T 7.2.2).
    """

    _section = "gait"

    amplitude: float = 40 * DEGREE
    omega: float = 80 * DEGREE
    beta: float = -50 * DEGREE
    gamma: float = 0.0
    vertical_amplitude: float = 0.0
    vertical_omega: float = 0.0
    vertical_beta: float = 0.0
    vertical_phase: float = 0.0
    soft_start: bool = False

    @classmethod
    def lateral_undulation(cls, **changes: Any) -> Gait:
        """Lateral undulation (T 7.3); keywords replace the thesis's values."""
        return cls(**changes)

    @classmethod
    def sidewinding(cls, **changes: Any) -> Gait:
        """Sidewinding (T 7.5): the vertical wave has the rate and phase shift of the horizontal one."""
        values = {"amplitude": 30 * DEGREE, "vertical_amplitude": 10 * DEGREE} | changes
        return cls._with_vertical(values)

    @classmethod
    def lateral_rolling(cls, **changes: Any) -> Gait:
        """U-shaped lateral rolling (T 7.4): both waves alike, a quarter period apart."""
        values = {"amplitude": 10 * DEGREE, "beta": 0.0} | changes
        values.setdefault("vertical_amplitude", values["amplitude"])
        return cls._with_vertical(values)

    @classmethod
    def sinus_lifting(cls, **changes: Any) -> Gait:
        """Lateral undulation that lifts the crests of its curve, where a link would slide sideways: faster on ground
        with more friction across the links than along them.

        The vertical wave has twice the rate and phase shift of the horizontal one and stands highest where that bends
        most; half a degree suffices, since the joints are stiff.
        """
        values = {"vertical_amplitude": 0.5 * DEGREE} | changes
        values.setdefault("vertical_omega", 2 * values.get("omega", cls.omega))
        values.setdefault("vertical_beta", 2 * values.get("beta", cls.beta))
        values.setdefault("vertical_phase", -90 * DEGREE)
        return cls(**values)

    @classmethod
    def caterpillar(cls, **changes: Any) -> Gait:
        """A vertical wave that travels along a robot straight seen from above, and takes it along."""
        values = {"amplitude": 0.0, "vertical_amplitude": 10 * DEGREE, "vertical_phase": 0.0} | changes
        return cls._with_vertical(values)

    def reference(self, time: ArrayLike, joints: int = 10, vertical: bool = False) -> dict[str, NDArray[np.float64]]:
        """The horizontal or vertical references at given times: "angle", "rate", "acceleration", (T, joints) each."""
        times = np.atleast_1d(np.asarray(time, np.float64)).tolist()
        return _native.gait_reference(encode(self._for_core(), self._section), joints, times, vertical)

    @classmethod
    def _with_vertical(cls, values: dict[str, Any]) -> Gait:
        values.setdefault("vertical_omega", values.get("omega", cls.omega))
        values.setdefault("vertical_beta", values.get("beta", cls.beta))
        values.setdefault("vertical_phase", 90 * DEGREE)
        return cls(**values)


@dataclass(frozen=True)
class PD(_Section):
    """Joint controller tau = -k_P (phi_d - phi) - k_D (phi_d' - phi') (T 3.51), (T 7.8) with the other sign.

    Args:
        kp: k_P [N m/rad], >= 0.
        kd: k_D [N m s/rad], >= 0.
        torque_limit: largest torque of a joint [N m], > 0; None for none.
        active_from: the actuators are off before this time [s], >= 0.
        treatment: as for :class:`IOLinearizing`; the planar model takes "implicit" alone.
    """

    _section = "controller"

    kp: float = 800.0
    kd: float = 2.0
    torque_limit: float | None = None
    active_from: float = 0.0
    treatment: str | float = "implicit"

    def __post_init__(self) -> None:
        super().__post_init__()
        _native.check("feedback", encode(self._feedback(), self._section))

    def _for_core(self) -> dict[str, Any]:
        return _controller("pd", self)

    def _for_planar(self) -> dict[str, Any]:
        """The planar model's part; what it has not is refused."""
        return _planar_controller("pd", self)

    def _feedback(self) -> dict[str, Any]:
        """The controller of the robot model."""
        return {**_controller("pd", self), "treatment": self.treatment}


@dataclass(frozen=True)
class IOLinearizing(_Section):
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

    _section = "controller"

    kp: float = 4e5
    kd: float = 2.4e3
    torque_limit: float | None = None
    active_from: float = 0.0
    treatment: str | float = "implicit"

    def __post_init__(self) -> None:
        _native.check("feedback", encode(self._feedback(), self._section))

    @classmethod
    def for_period(cls, period: float, **changes: Any) -> IOLinearizing:
        """Critically damped gains K_D = 0.5 / T, K_P = K_D^2 / 4 for torques held over a control period T [s].

        Torques are held over the period unless ``treatment`` says otherwise.
        """
        if not (isinstance(period, float | int) and 0.0 < period < math.inf):
            raise ConfigError("controller.period", repr(period), "a finite number > 0")
        kd = 0.5 / period
        return cls(**({"kp": 0.25 * kd * kd, "kd": kd, "treatment": period} | changes))

    def _for_planar(self) -> dict[str, Any]:
        """The planar model's part; what it has not is refused."""
        return _planar_controller("io", self)

    def _feedback(self) -> dict[str, Any]:
        """The controller of the robot model."""
        return {**_controller("io", self), "treatment": self.treatment}


def _controller(law: str, controller: PD | IOLinearizing) -> dict[str, Any]:
    names = ("kp", "kd", "torque_limit", "active_from")
    return {"law": law, **{name: getattr(controller, name) for name in names}}


def _planar_controller(law: str, controller: PD | IOLinearizing) -> dict[str, Any]:
    if controller.treatment != "implicit":
        raise ConfigError("controller.treatment", repr(controller.treatment), '"implicit", or model="minimal"')
    return _controller(law, controller)


@dataclass(frozen=True)
class Noise(_Section):
    """Amplitudes of the uniform noise on what a controller measures (T 7.9)-(T 7.14); each measurement draws anew.

    Measurements are taken when the controller's ``treatment`` computes torques, for "implicit" every 2.5e-4 s as in the
    thesis.

    Args:
        position: N_p [m], >= 0; no controller uses the position.
        heading: N_theta [rad], >= 0.
        joint_angle: N_phi [rad], >= 0.
        velocity: N_v of O_2 [m/s], >= 0.
        yaw_rate: N_theta' [rad/s], >= 0.
        joint_rate: N_phi' [rad/s], >= 0.
    """

    _section = "noise"

    position: float = 0.0
    heading: float = 0.0
    joint_angle: float = 0.0
    velocity: float = 0.0
    yaw_rate: float = 0.0
    joint_rate: float = 0.0

    @classmethod
    def table_7_4(cls, row: str) -> Noise:
        """Row "b", "c" or "d" of (T Table 7.4): the noise of Fig. 7.11 (b), (c) and (d)."""
        rows = {"b": (0.1, 0.1, 0.1), "c": (10.0, 10.0, 0.1), "d": (10.0, 10.0, 1.0)}
        if row not in rows:
            raise ConfigError("noise.table_7_4", repr(row), '"b", "c" or "d"')
        base, turn, joint = rows[row]
        return cls(base, turn * DEGREE, joint * DEGREE, base, turn * DEGREE, joint * DEGREE)


Range = tuple[float, float]


@dataclass(frozen=True)
class Randomization(_Section):
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
    """

    _section = "randomization"

    friction: Range = (1.0, 1.0)
    anisotropy: Range = (1.0, 1.0)
    mass: Range = (1.0, 1.0)
    torque_limit: Range = (1.0, 1.0)
    reference_rate: float | None = None
    reference_delay: Range = (0.0, 0.0)
    noise: Noise | Mapping[str, float] = dataclasses.field(default_factory=Noise)
    peg_error: float = 0.0

    @classmethod
    def thesis(cls) -> Randomization:
        """Everything at once: worn varnish, motors that saturate, references at 10 Hz that come 50 to 150 ms late, a
        tenth of the mass, sensors of (T Table 7.4 b) without its error of 10 cm in position, pegs 1 cm off.
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
        )


@dataclass(frozen=True)
class Integrator(_Section):
    """Time stepping; None takes the method's own default, and ``Integrator()`` is the environments'.

    Args:
        method: "implicit", the fast default; "adaptive", steps as long as an accuracy of positions allows, one robot
            at a time; or "thesis", the time stepping and Modified Newton iteration as printed (T Algorithm 3.1).
        step: largest step [s], > 0; a sample interval is divided into equal steps no longer than this. "implicit":
            0.025, and shorter in the first 0.2 s after the robot was placed. "adaptive": 0.05, steps as needed below.
            0.01 for the spatial model. 0.02 for the robot model, 2.5e-4 if torques are held over steps; its smooth
            plants have a solver that chooses its own.
        tolerance: > 0. "thesis": the iteration stops when the impulses change by less [N s] (T 3.81).
            "implicit": accuracy of the velocities in a stage [m/s]. "adaptive": error to expect of any link's position
            after a few seconds of motion [m], in [1e-7, 0.1], default 1e-4.
            A smooth plant of the robot model: relative tolerance, default 1e-6.
        max_iterations: after which a solve is given up and counted as a miss, >= 1.
        order: 1 or 2. "implicit": implicit Euler, or the two-stage SDIRK scheme.
        event_substeps: "implicit", order 2: Euler steps that at most replace a step in which a peg's force changes
            abruptly.
        event_tolerance: "implicit", order 2: deviation of a stage from its prediction beyond which that is so [m],
            > 0; None: 0.32 m/s^2 times the squared step.
        r_t: r_T of (T 3.79), > 0; None takes the thesis's, 1.3, 0.2 for the robot model, 0.01 for the spatial model.
            "thesis" alone.
        r_h: r_H of (T 3.78), > 0. "thesis" alone.
        r_n: r_N of (T 4.113), > 0. "thesis", the spatial model alone.
        r_v: r_V of (T 4.115), > 0. "thesis", the spatial model alone.
    """

    _section = "integrator"

    method: str = "implicit"
    step: float | None = None
    tolerance: float | None = None
    max_iterations: int | None = None
    order: int = 2
    event_substeps: int = 4
    event_tolerance: float | None = None
    r_t: float | None = None
    r_h: float = 0.01
    r_n: float = 0.1
    r_v: float = 0.05


@dataclass(frozen=True)
class Start:
    """Where the robot starts, at rest.

    Args:
        position: CG of link 1 (x, y) [m]; of the first real link in the robot model. In the spatial model also
            (x, y, z); without z the robot rests on the ground.
        heading: absolute angle theta_1 of link 1 [rad]; with pi the body axes point to -x and the
            leading link faces +x. In the spatial model the yaw of its centre line.
        posture: "gait" (joint angles equal the reference at t = 0), "straight", or n - 1 joint angles [rad]; in the
            spatial model also n - 1 pairs (yaw, pitch).
        pitch: lifts the chain about link 1 [rad], in [-pi/2, pi/2]; the spatial model alone.
        roll: turns the chain about the centre line of link 1 [rad]; the spatial model alone. None is 0, but -pi/2, on
            its side, for a gait that also yaws and whose posture bends up and down alone, as lateral rolling's.
    """

    position: tuple[float, float] | tuple[float, float, float] = (0.0, 0.0)
    heading: float = math.pi
    posture: str | Sequence[float] | Sequence[tuple[float, float]] = "gait"
    pitch: float = 0.0
    roll: float | None = None

    def _for_plane(self) -> dict[str, Any]:
        """The part of the models in the plane; what they have not is refused."""
        for name in ("pitch", "roll"):
            if getattr(self, name):
                raise ConfigError(f"start.{name}", repr(getattr(self, name)), '0, or model="spatial"')
        return {name: getattr(self, name) for name in ("position", "heading", "posture")}

    @classmethod
    def on_course(cls, scene: Scene, model: str = "planar") -> Start:
        """The start from which the robot in the posture of the gait threads a preset course, ready to move to +x.

        Args:
            scene: made by :meth:`Scene.preset`.
            model: "planar" or "spatial"; friction acts elsewhere in the latter, so its starts differ by centimetres.
        """
        _checks.choice("model", model, ("planar", "spatial"))
        if scene.course is None:
            raise ConfigError("scene.course", None, "a scene made by Scene.preset")
        x, y, heading = _course(scene.course)["start" if model == "planar" else "spatial_start"]
        return cls(position=(x, y), heading=heading)
