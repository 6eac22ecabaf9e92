"""MuJoCo on the same scenes: error against the same reference, speed on one thread, throughput of its batch."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from mujoco.batch import Batch
from numpy.typing import NDArray

from benchmarks import mujoco_spatial
from benchmarks.mujoco_model import Setup, build, placed
from benchmarks.mujoco_spatial import SpatialSetup
from snake_env.policies.gaits import GaitParameters

Record = dict[str, Any]

STEPS = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002)
QUICK_STEPS = (0.02, 0.005, 0.001)
SHORT_RUN = 0.2
"""Runs that take less CPU time than this are repeated [s]."""
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
MIDDLE = 5
"""Link 6."""
CONTROL_PERIOD = 0.05
BATCH_STEP = 0.01


def can_do(scene: Record) -> bool:
    """MuJoCo's contact frames do not turn with the links: isotropic friction only."""
    along, across = scene["scenario"]["scene"]["friction"]
    return along == across


def points(scene: Record, quick: bool, progress: Callable[[str], None]) -> Iterator[Record]:
    """Work-precision of all set-ups on a scene record of ``snake-bench``."""
    scenario = scene["scenario"]
    reference = np.array(scene["reference"]["links"])
    if in_space(scenario):
        yield from _points_in_space(scene["scene"], scenario, reference, quick, progress)
        return
    for setup in setups(bool(scenario["scene"]["obstacles"]), quick):
        progress(_text(scene["scene"], setup))
        yield point(scene["scene"], scenario, reference, setup)


def in_space(scenario: Record) -> bool:
    """Whether a scenario is one of the spatial model: it has a vertical wave."""
    return "pitch" in scenario


def _points_in_space(
    name: str, scenario: Record, ours: NDArray[np.float64], quick: bool, progress: Callable[[str], None]
) -> Iterator[Record]:
    """The same in 3D, where soft contacts converge to a different motion, which is MuJoCo's reference."""
    coarse, fine = (_reference(name, scenario, setup, progress) for setup in mujoco_spatial.reference_setups(quick))
    own = {
        "uncertainty": _errors(fine, coarse),
        "apart": _errors(fine, ours),
        "against": "its own converged run",
    }
    for setup in mujoco_spatial.setups(quick):
        progress(_text(name, setup))
        yield point(name, scenario, fine, setup) | own


def _reference(
    name: str, scenario: Record, setup: SpatialSetup, progress: Callable[[str], None]
) -> NDArray[np.float64]:
    progress(_text(name, setup))
    run = Run(scenario, setup)
    run.seconds()
    return run.positions()


def _text(name: str, setup: Setup | SpatialSetup) -> str:
    return f"{name}: MuJoCo, {1e3 * setup.step:g} ms, tolerance {setup.tolerance:g}"


def setups(pegs: bool, quick: bool) -> list[Setup]:
    """What is tried; the best at each error is what counts."""
    if quick:
        return [Setup(step, 1e-4, 1e-2) for step in QUICK_STEPS]
    solvers = [(1e-4, "CG"), (1e-6, "CG"), (1e-8, "CG"), (1e-8, "Newton")]
    times = (1e-4, 5e-3, 1e-2) if pegs else (1e-4,)
    return [Setup(step, tol, peg_time, solver) for tol, solver in solvers for peg_time in times for step in STEPS]


def point(name: str, scenario: Record, reference: NDArray[np.float64], setup: Setup | SpatialSetup) -> Record:
    """Error and speed of one set-up; the speed is the median of the repetitions."""
    run = Run(scenario, setup)
    seconds = [run.seconds()]
    while len(seconds) < 5 and seconds[0] < SHORT_RUN:
        seconds.append(run.seconds())
    return {
        "kind": "peer",
        "peer": "MuJoCo",
        "scene": name,
        "curve": f"MuJoCo {mujoco.__version__}",
        "setup": vars(setup),
        "error": _errors(run.positions(), reference),
        "speed_alone": scenario["duration"] / statistics.median(seconds),
        "repetitions": len(seconds),
    }


def _errors(positions: NDArray[np.float64], reference: NDArray[np.float64]) -> dict[str, float] | None:
    """Distances of the worst link and of link 6 [m]; None of a run that left the finite numbers."""
    distance = np.linalg.norm(positions - reference, axis=1)
    finite = bool(np.isfinite(distance).all())
    return {"worst": float(distance.max()), "link6": float(distance[MIDDLE])} if finite else None


class Run:
    """One run under the scenario's gait, inside MuJoCo's own loop: no Python between steps."""

    def __init__(self, scenario: Record, setup: Setup | SpatialSetup) -> None:
        if isinstance(setup, SpatialSetup):
            self._model, self._coordinates = mujoco_spatial.build(scenario, setup), 3
            self._data = mujoco_spatial.placed(self._model, scenario)
            self._control = mujoco_spatial.servo_targets(scenario, setup.step)
        else:
            self._model, self._coordinates = build(scenario, setup), 2
            self._data = placed(self._model, scenario)
            self._control = servo_targets(setup.step, round(scenario["duration"] / setup.step), self._model.nu)
        self._start = state_of(self._model, self._data)
        self._end = self._start

    def seconds(self) -> float:
        """CPU time of one run [s]."""
        start = time.process_time()
        states, _ = rollout.rollout(self._model, self._data, self._start, self._control[None])
        spent = time.process_time() - start
        self._end = states[0, -1].copy()
        return spent

    def positions(self) -> NDArray[np.float64]:
        """CGs of the links (n, 2), in 3D (n, 3), at the end of the last run [m]."""
        mujoco.mj_setState(self._model, self._data, self._end, STATE)
        mujoco.mj_kinematics(self._model, self._data)
        return self._data.xipos[1:, : self._coordinates].copy()


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """The full physical state as one row."""
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def servo_targets(step: float, count: int, joints: int, kp: float = 800.0, kd: float = 2.0) -> NDArray[np.float64]:
    """Set-points (count, joints) at the ends of the steps: phi_d + kd / kp phi_d', which makes a servo with
    damping kd the PD controller (T 3.51).
    """
    gait = GaitParameters()
    phase = gait.omega * step * np.arange(1, count + 1)[:, None] + gait.beta * np.arange(joints)
    return gait.amplitude * (np.sin(phase) + kd / kp * gait.omega * np.cos(phase))


def batch_rates(scene: Record, robots: int, seconds: float, threads: tuple[int, ...] = (1, 2)) -> Iterator[Record]:
    """Environment steps per second of ``mujoco.batch``: control period 0.05 s, steps of 10 ms."""
    model = build(scene["scenario"], Setup(BATCH_STEP, 1e-4, 5e-3))
    starts = _staggered(model, scene["scenario"], robots)
    control = servo_targets(CONTROL_PERIOD, round(scene["scenario"]["duration"] / CONTROL_PERIOD), model.nu)
    for count in threads:
        batch = Batch(model, robots, nthread=count)
        batch.qpos[:], batch.qvel[:] = starts[:, 1 : 1 + model.nq], starts[:, 1 + model.nq : 1 + model.nq + model.nv]
        offset = _offsets(robots, len(control))
        steps, start, cpu = 0, time.perf_counter(), time.process_time()
        while (elapsed := time.perf_counter() - start) < seconds:
            batch.ctrl[:] = control[(offset + steps) % len(control)]
            batch.step(nstep=round(CONTROL_PERIOD / BATCH_STEP))
            steps += 1
        yield {
            "kind": "peer_batch",
            "peer": "MuJoCo",
            "scene": scene["scene"],
            "robots": robots,
            "threads": count,
            "steps_per_second": robots * steps / elapsed,
            "steps_per_cpu_second": robots * steps / (time.process_time() - cpu),
        }


def _staggered(model: mujoco.MjModel, scenario: Record, robots: int) -> NDArray[np.float64]:
    """States of one run, evenly spread over it."""
    data = placed(model, scenario)
    control = servo_targets(BATCH_STEP, round(scenario["duration"] / BATCH_STEP), model.nu)
    states, _ = rollout.rollout(model, data, state_of(model, data), control[None])
    return states[0, _offsets(robots, len(states[0]))]


def _offsets(robots: int, count: int) -> NDArray[np.int64]:
    return np.arange(robots) * count // robots
