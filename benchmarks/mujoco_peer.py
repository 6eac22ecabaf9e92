"""MuJoCo on the same scenes: error against the same reference, and speed on one thread."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from benchmarks import mujoco_spatial
from benchmarks.mujoco_model import DEFAULT, STIFF, Setup, build, placed
from benchmarks.mujoco_spatial import SpatialSetup
from snake_env.policies.gaits import GaitParameters

Record = dict[str, Any]

STEPS = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002)
QUICK_STEPS = (0.02, 0.005, 0.001)
SHORT_RUN = 0.2
"""Runs that take less CPU time than this are repeated [s]."""
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS


def points(scene: Record, quick: bool, progress: Callable[[str], None]) -> Iterator[Record]:
    """Work-precision of all set-ups on a scene record of ``snake-bench``."""
    scenario = scene["scenario"]
    reference, sample = np.array(scene["reference"]["samples"]), scene["reference"]["sample"]
    if is_spatial(scenario):
        yield from _spatial_points(scene["scene"], scenario, reference, sample, quick, progress)
        return
    for setup in setups(bool(scenario["scene"]["obstacles"]), quick):
        progress(_text(scene["scene"], setup))
        yield point(scene["scene"], scenario, reference, sample, setup)


def is_spatial(scenario: Record) -> bool:
    """Whether a scenario is one of the spatial model: it has a vertical wave."""
    return "pitch" in scenario


def _spatial_points(
    name: str,
    scenario: Record,
    ours: NDArray[np.float64],
    sample: float,
    quick: bool,
    progress: Callable[[str], None],
) -> Iterator[Record]:
    """The same in 3D, where soft contacts converge to a different motion, which is MuJoCo's reference."""
    fine_setups = mujoco_spatial.reference_setups(quick)
    coarse, fine = (_reference(name, scenario, sample, setup, progress) for setup in fine_setups)
    own = {
        "uncertainty": _errors(fine, coarse),
        "apart": _errors(fine, ours),
        "against": "its own converged run",
    }
    for setup in mujoco_spatial.setups(quick):
        progress(_text(name, setup))
        yield point(name, scenario, fine, sample, setup) | own


def _reference(
    name: str, scenario: Record, sample: float, setup: SpatialSetup, progress: Callable[[str], None]
) -> NDArray[np.float64]:
    progress(_text(name, setup))
    run = Run(scenario, setup)
    run.seconds()
    return run.positions(sample)


def _text(name: str, setup: Setup | SpatialSetup) -> str:
    return f"{name}: MuJoCo, {1e3 * setup.step:g} ms, tolerance {setup.tolerance:g}"


def setups(pegs: bool, quick: bool) -> list[Setup]:
    """What is tried; the best at each error is what counts."""
    if quick:
        return [Setup(step, 1e-4, 1e-2) for step in QUICK_STEPS]
    contacts = list(product((1e-4, 2e-3, 5e-3), (DEFAULT, STIFF)))[: None if pegs else 1]
    solvers = ((1e-2, "CG"), (1e-6, "CG"), (1e-8, "Newton"))
    return [Setup(step, tol, *one, solver) for (tol, solver), one, step in product(solvers, contacts, STEPS)]


def point(
    name: str, scenario: Record, reference: NDArray[np.float64], sample: float, setup: Setup | SpatialSetup
) -> Record:
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
        "error": _errors(run.positions(sample), reference),
        "speed_alone": scenario["duration"] / statistics.median(seconds),
        "repetitions": len(seconds),
    }


def _errors(positions: NDArray[np.float64], reference: NDArray[np.float64]) -> dict[str, float] | None:
    """Distance of the worst link over all samples, and at the last one [m]; None of a run that left the finite numbers.

    Args:
        positions: (samples, n, 2 or 3).
        reference: of the same shape.
    """
    distance = np.linalg.norm(positions - reference, axis=-1)
    finite = bool(np.isfinite(distance).all())
    return {"worst": float(distance.max()), "end": float(distance[-1].max())} if finite else None


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
        self._states = self._start[None]
        self._step, self._links = setup.step, scenario["robot"]["links"]

    def seconds(self) -> float:
        """CPU time of one run [s]."""
        start = time.process_time()
        states, _ = rollout.rollout(self._model, self._data, self._start, self._control[None])
        spent = time.process_time() - start
        self._states = states[0]
        return spent

    def positions(self, sample: float) -> NDArray[np.float64]:
        """CGs of the links in the last run every ``sample`` seconds: (samples, n, 2), in 3D (samples, n, 3) [m]."""
        every = round(sample / self._step)
        return np.array([self._positions_in(state) for state in self._states[every - 1 :: every]])

    def _positions_in(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        mujoco.mj_setState(self._model, self._data, state, STATE)
        mujoco.mj_kinematics(self._model, self._data)
        return self._data.xipos[-self._links :, : self._coordinates].copy()


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
