"""Environment steps per second of ``mujoco.batch`` under the actions of our environments.

All robots start as ours do after a reset with one seed, in one scene, and their servos take the set-points that
give the torques of ours at the end of each control period. Only physics is timed: no observation, reward or reset.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import snake_env
from benchmarks import mujoco_model, mujoco_spatial
from snake_env import Scene, _native
from snake_env.evaluation.rollout import make_env
from snake_env.state import State

Record = dict[str, Any]

STEP = 0.01
"""Time step of MuJoCo [s]."""
PERIODS = 60
"""Control periods that are recorded and played over and over: no episode of ours ends in them."""
ENVIRONMENTS = ("SnakeCourse-v1", "SnakeField-v1", "SnakeCorridor-v1", "SnakeSpatial-v1")
ACTIONS = ("gait", "random")


class Recording(NamedTuple):
    """What our robots started from and were told.

    Attributes:
        scenario: robot, scene and gains, as in the records of ``snake-bench``.
        qpos: (n, nq) coordinates of MuJoCo's model at the start.
        control: (PERIODS, n, nu) set-points.
        period: control period [s].
    """

    scenario: Record
    qpos: NDArray[np.float64]
    control: NDArray[np.float64]
    period: float


def rates(robots: int, seconds: float, threads: tuple[int, ...], progress: Callable[[str], None]) -> Iterator[Record]:
    """A record per environment, kind of actions and number of threads."""
    for env_id in ENVIRONMENTS:
        for actions in ACTIONS:
            progress(f"{env_id}: MuJoCo, batch, {actions}")
            recording = record(env_id, actions, robots)
            for count in threads:
                yield {
                    "kind": "peer_batch",
                    "peer": "MuJoCo",
                    "env": env_id,
                    "actions": actions,
                    "robots": robots,
                    "threads": count,
                    **rate(recording, count, seconds),
                }


def record(env_id: str, actions: str, robots: int) -> Recording:
    """Starts and set-points of ``robots`` robots of ours."""
    envs = make_env(env_id, robots, 1, action_mode="gait").unwrapped
    envs.reset(seed=[0] * robots)
    start, gains = envs.state(), _gains()
    draw = np.random.default_rng(0)
    control = []
    shape = (robots, len(envs.layout["action"]))
    for _ in range(PERIODS):
        envs.step((np.zeros(shape) if actions == "gait" else draw.uniform(-1.0, 1.0, shape)).astype(np.float32))
        state = envs.state()
        rate = gains["kd"] / gains["kp"] * state.joint_rate
        control.append(state.joint_angle + rate - state.joint_torque / gains["kp"])
    scenario = _scenario(envs.scene(0), gains)
    qpos = _spatial_start(start) if start.link_position.shape[-1] == 3 else _planar_start(start)
    return Recording(scenario, qpos, np.array(control).reshape(PERIODS, robots, -1), envs.control_period)


def _gains() -> Record:
    controller = snake_env.PD()
    return {"kp": controller.kp, "kd": controller.kd, "torque_limit": controller.torque_limit}


def _scenario(scene: Scene, gains: Record) -> Record:
    obstacles = [list(peg) for peg in scene.obstacles if isinstance(peg, tuple)]
    return {
        "robot": _native.defaults("robot"),
        "scene": {"obstacles": obstacles, "friction": list(scene.friction)},
        "controller": gains,
        "start": [0.0, 0.0, 0.0],
        "joint_angle": [0.0] * (_native.defaults("robot")["links"] - 1),
    }


def _planar_start(state: State) -> NDArray[np.float64]:
    head = np.column_stack([state.link_position[:, 0], np.asarray(state.link_angle)[:, 0]])
    return np.hstack([head, state.joint_angle])


def _spatial_start(state: State) -> NDArray[np.float64]:
    """MuJoCo's links have x along the centre line and z up, ours z along the centre line and y up."""
    turned = Rotation.from_quat(np.asarray(state.link_quaternion)[:, 0], scalar_first=True).as_matrix()[:, :, [2, 0, 1]]
    quaternion = Rotation.from_matrix(turned).as_quat(scalar_first=True)
    return np.hstack([state.link_position[:, 0], quaternion, state.joint_angle.reshape(len(quaternion), -1)])


def rate(recording: Recording, threads: int, seconds: float) -> Record:
    """Plays a recording, from the start each time, until the time is over; the rates are those of the fastest one."""
    spatial = recording.qpos.shape[1] > 3 + recording.control.shape[2]
    if spatial:
        setup = mujoco_spatial.SpatialSetup(STEP, 1e-4, *mujoco_spatial.CONTACTS[1], "CG")
        model = mujoco_spatial.build(recording.scenario, setup)
    else:
        model = mujoco_model.build(recording.scenario, mujoco_model.Setup(STEP, 1e-4, 5e-3))
    batch = Batch(model, len(recording.qpos), nthread=threads)
    wall: list[float] = []
    spent: list[float] = []
    begin = time.perf_counter()
    while not wall or time.perf_counter() - begin < seconds:
        start, cpu = time.perf_counter(), time.process_time()
        batch.qpos[:], batch.qvel[:] = recording.qpos, 0.0
        for control in recording.control:
            batch.ctrl[:] = control
            batch.step(nstep=round(recording.period / STEP))
        wall.append(time.perf_counter() - start)
        spent.append(time.process_time() - cpu)
    steps = len(recording.qpos) * PERIODS
    return {"steps_per_second": steps / min(wall), "steps_per_cpu_second": steps / min(spent)}
