"""Single control periods from states in mid-run, under random actions: the reference, ours and MuJoCo.

Robots start from the states of a fine run of ours, so that the error of one period is that of the method and not what
contacts make of it later. MuJoCo gets positions and velocities, and the set-points of the ends of its steps.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks import mujoco_model, mujoco_spatial
from benchmarks.mujoco_model import Setup
from benchmarks.mujoco_spatial import SpatialSetup
from benchmarks.set_points import set_points
from snake_env.evaluation.rollout import make_env
from snake_env.state import State

Array = NDArray[np.float64]
Record = dict[str, Any]

LONGEST_WITH_LIMITED_FORCE = 2.5e-3
"""MuJoCo's integrator drops stiffness and damping of a servo whose force is limited, and is unstable beyond this step
[s]; beyond it the set-points are clipped such that the force predicted for the end of the step is within the limit."""
SCENES = 8
"""Scenes of a case; robots of one scene differ in their actions."""


@dataclass(frozen=True)
class Case:
    """An environment under random actions of a mode."""

    env: str
    actions: str
    options: tuple[tuple[str, Any], ...] = ()

    def make(self, robots: int, integrator: Record) -> Any:
        """A batch of ours on one thread, reset; no episode ends in it."""
        options = {"termination": {"is_success": False, "left_corridor": False}, **dict(self.options)}
        envs = make_env(self.env, robots, 1, action_mode=self.actions, integrator=integrator, **options).unwrapped
        envs.reset(seed=[SCENES * robot // robots for robot in range(robots)])
        return envs


class Period(NamedTuple):
    """A control period of the reference.

    Attributes:
        saved: states of our robots at its start.
        start: the same as arrays.
        actions: (n, a).
        end: (n, L, 2) positions of the links at its end [m]; (n, L, 3) in 3D.
        work: (n,) positive actuator work [J].
    """

    saved: list[Any]
    start: State
    actions: NDArray[np.float32]
    end: Array
    work: Array


class Played(NamedTuple):
    """Positions of the links at the end (n, L, 2 or 3) [m], positive work (n,) [J], and CPU time [s]."""

    end: Array
    work: Array
    seconds: float


class Player(Protocol):
    """A simulator with its settings."""

    def play(self, first: int, periods: int) -> Played:
        """Plays control periods of the reference, from its state at the start of the ``first``."""


class Course:
    """The reference: a fine run of ours from a reset on, and what the others need of it.

    Args:
        case: environment and actions.
        robots: a multiple of :data:`SCENES`.
        periods: number of control periods.
        integrator: of the fine run.
        seed: of the actions.
    """

    def __init__(self, case: Case, robots: int, periods: int, integrator: Record, seed: int = 0) -> None:
        envs = case.make(robots, integrator)
        self.case, self.robots, self.period = case, robots, float(envs.control_period)
        self.layout, begin = envs.layout, envs.state()
        self._posture = begin.joint_angle.reshape(robots, -1)
        shape = (periods, robots, len(self.layout["action"]))
        self.actions = np.random.default_rng(seed).uniform(-1.0, 1.0, shape).astype(np.float32)
        self.periods = [_period(envs, actions) for actions in self.actions]
        config = self.layout["config"]
        self.controller = config["controller"]
        self.scenarios = [
            {
                "robot": config["robot"],
                "scene": {"obstacles": [list(peg) for peg in scene.obstacles], "friction": list(scene.friction)},
                "controller": self.controller,
                "start": [0.0, 0.0, 0.0],
                "joint_angle": [0.0] * (config["robot"]["links"] - 1),
            }
            for scene in map(envs.scene, range(0, robots, robots // SCENES))
        ]

    def set_points(self, step: float) -> Array:
        """(periods, steps per period, n, joints) at the ends of steps [s] of MuJoCo."""
        lead = self.controller["kd"] / self.controller["kp"]
        actions = self.actions.astype(np.float64)
        return set_points(self.layout["action"], self._posture, actions, self.period, step, lead)

    def errors(self, player: Player, starts: Sequence[int]) -> tuple[Array, float, float]:
        """Errors of the worst link after one period from each of some starts [m], bias of the work, CPU time [s]."""
        played = [player.play(start, 1) for start in starts]
        periods = [self.periods[start] for start in starts]
        distance = [np.linalg.norm(p.end - q.end, axis=-1).max(-1) for p, q in zip(played, periods, strict=True)]
        work = [sum(float(one.work.sum()) for one in many) for many in (played, periods)]
        return np.concatenate(distance), work[0] / work[1] - 1.0, sum(one.seconds for one in played)


def _period(envs: Any, actions: NDArray[np.float32]) -> Period:
    saved, start = envs.get_state(), envs.state()
    *_, info = envs.step(actions)
    return Period(saved, start, actions, envs.state().link_position, info["positive_work"].copy())


class Ours:
    """Our environment, with everything its step does, at the settings of an integrator."""

    def __init__(self, course: Course, integrator: Record) -> None:
        self._course, self._envs = course, course.case.make(course.robots, integrator)

    def play(self, first: int, periods: int) -> Played:
        """Steps the environment."""
        # Below `set_state`, since the states are those of another integrator; the first period inherits its parts.
        states = [state.core for state in self._course.periods[first].saved]
        self._envs._robots.native.set_states(range(len(states)), states)
        work, seconds = np.zeros(self._course.robots), 0.0
        for period in self._course.periods[first : first + periods]:
            begin = time.process_time()
            *_, info = self._envs.step(period.actions)
            seconds += time.process_time() - begin
            work += info["positive_work"]
        return Played(self._envs.state().link_position, work, seconds)


class Mujoco:
    """MuJoCo's batch on the same robots, one thread; set-points, clipping and work are not timed."""

    def __init__(self, course: Course, setup: Setup | SpatialSetup) -> None:
        self._course, self._points = course, course.set_points(setup.step)
        self._clips = setup.step > LONGEST_WITH_LIMITED_FORCE
        self._setup = setup
        self.models = [self._model(scenario) for scenario in course.scenarios]
        rows = np.split(np.arange(course.robots), SCENES)
        self._batches = [(Batch(m, len(r), nthread=1), r) for m, r in zip(self.models, rows, strict=True)]
        for batch, _ in self._batches:
            batch.bind("xipos")  # A field is filled by the calls after its first use.

    def _model(self, scenario: Record) -> mujoco.MjModel:
        if self._clips:
            scenario = scenario | {"controller": scenario["controller"] | {"torque_limit": None}}
        if isinstance(self._setup, SpatialSetup):
            return mujoco_spatial.build(scenario, self._setup)
        return mujoco_model.build(scenario, self._setup)

    def play(self, first: int, periods: int) -> Played:
        """Steps the batches, scene by scene, in MuJoCo's own loop."""
        start = self._course.periods[first].start
        qpos, qvel = coordinates(start)
        end, work, seconds = np.empty_like(start.link_position), np.zeros(len(qpos)), 0.0
        joints = self._points.shape[-1]
        for batch, rows in self._batches:
            points = self._points[first : first + periods, :, rows].reshape(-1, len(rows), joints).swapaxes(0, 1)
            if self._clips:
                _place(batch, qpos[rows], qvel[rows])
                points = self._clipped(batch, points)
            _place(batch, qpos[rows], qvel[rows])
            begin = time.process_time()
            moved = batch.rollout(points.shape[1], control=points, record=("qpos", "qvel"))
            seconds += time.process_time() - begin
            angle, rate = (moved[name][..., -joints:] for name in ("qpos", "qvel"))
            before = np.concatenate([qpos[rows, None, -joints:], angle[:, :-1]], axis=1)
            work[rows] = np.maximum(self._torque(points, angle, rate) * (angle - before), 0.0).sum(axis=(1, 2))
            batch.forward(stage=mujoco.mjtStage.mjSTAGE_POS)
            end[rows] = batch.xipos[:, -end.shape[1] :, : end.shape[2]]
        return Played(end, work, seconds)

    def _clipped(self, batch: Batch, points: Array) -> Array:
        """Set-points (n, steps, joints) within what the torque limit admits, found step by step."""
        gains, joints = self._course.controller, points.shape[-1]
        lead, reach = self._setup.step + gains["kd"] / gains["kp"], gains["torque_limit"] / gains["kp"]
        clipped = np.empty(points.shape)
        for k in range(points.shape[1]):
            middle = batch.qpos[:, -joints:] + lead * batch.qvel[:, -joints:]
            batch.ctrl[:] = clipped[:, k] = np.clip(points[:, k], middle - reach, middle + reach)
            batch.step()
        return clipped

    def _torque(self, points: Array, angle: Array, rate: Array) -> Array:
        gains = self._course.controller
        torque = gains["kp"] * (points - angle) - gains["kd"] * rate
        limit = np.inf if self._clips else gains["torque_limit"]
        return np.clip(torque, -limit, limit)


def _place(batch: Batch, qpos: Array, qvel: Array) -> None:
    batch.qpos[:], batch.qvel[:], batch.qacc_warmstart[:] = qpos, qvel, 0.0


def coordinates(state: State) -> tuple[Array, Array]:
    """Coordinates qpos (n, nq) and qvel (n, nv) of MuJoCo's models in a state of our robots.

    In 3D MuJoCo's links have x along the centre line and z up, ours z along the centre line and y up.
    """
    first = state.link_position[:, 0], state.link_velocity[:, 0]
    joints = [values.reshape(len(values), -1) for values in (state.joint_angle, state.joint_rate)]
    if state.link_quaternion is None:
        turn = np.asarray(state.link_angle)[:, :1], state.link_angular_velocity[:, :1]
    else:
        axes = Rotation.from_quat(state.link_quaternion[:, 0], scalar_first=True).as_matrix()[:, :, [2, 0, 1]]
        rate = np.einsum("nij,ni->nj", axes, state.link_angular_velocity[:, 0])
        turn = Rotation.from_matrix(axes).as_quat(scalar_first=True), rate
    qpos, qvel = (np.hstack(parts) for parts in zip(first, turn, joints, strict=True))
    return qpos, qvel
