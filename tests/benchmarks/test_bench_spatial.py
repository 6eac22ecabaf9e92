"""MuJoCo's 3D snake: joints that turn like ours, a motion that is nearly ours, records that the page takes."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("mujoco")

import mujoco

import snake_env
from benchmarks import comparison, curves, mujoco_peer, mujoco_spatial
from benchmarks.mujoco_spatial import SpatialSetup
from benchmarks.results import Results
from snake_env import Gait, Integrator, Scene, Start, _native

WAVE = {"omega": np.radians(80), "beta": np.radians(-50), "gamma": 0.0}
SIDEWINDING = {
    "name": "spatial-sidewinding",
    "robot": _native.defaults("robot"),
    "scene": {"friction": [0.2, 0.2], "obstacles": []},
    "controller": {"kp": 800.0, "kd": 2.0, "torque_limit": None},
    "yaw": WAVE | {"amplitude": np.radians(30), "phase": 0.0},
    "pitch": WAVE | {"amplitude": np.radians(10), "phase": np.pi / 2},
    "soft_start": True,
    "start": [0.0, 0.0, np.pi],
    "duration": 0.5,
}
TABLE_7_5 = _native.courses()["table-7.5"]
COURSE = SIDEWINDING | {
    "name": "spatial-course-7.5",
    "scene": {"friction": [0.2, 0.2], "obstacles": [list(peg) for peg in TABLE_7_5["obstacles"]]},
    "yaw": WAVE | {"amplitude": np.radians(40), "phase": 0.0},
    "pitch": WAVE | {"amplitude": 0.0, "phase": 0.0},
    "soft_start": False,
    "start": list(TABLE_7_5["spatial_start"]),
}


def ours(scenario, step=0.0025):
    course = Scene.preset("table-7.5" if scenario["scene"]["obstacles"] else "free")
    sidewinding = {"gait": Gait.sidewinding(soft_start=True), "start": Start(posture="straight")}
    keywords = {} if course.obstacles else sidewinding
    run = snake_env.simulate("spatial", scene=course, duration=0.5, integrator=Integrator(step=step), **keywords)
    return run.position[np.searchsorted(run.time, np.arange(0.1, 0.51, 0.1) - 1e-9)]


def test_two_hinges_are_our_cardan_joint():
    model = mujoco_spatial.build(SIDEWINDING, SpatialSetup(1e-3))
    data = mujoco_spatial.placed(model, SIDEWINDING)
    posture = np.random.default_rng(1).uniform(-0.8, 0.8, (10, 2))
    data.qpos[7:] = posture.ravel()
    mujoco.mj_kinematics(model, data)
    start = Start(position=(0.0, 0.0, 1.0), posture=[tuple(pair) for pair in posture], roll=0.0)
    run = snake_env.simulate("spatial", start=start, duration=1e-4, sample=1e-4)
    np.testing.assert_allclose(np.add(data.xipos[1:], [0.0, 0.0, 1.0 - 0.0525]), run.position[0], atol=1e-12)
    np.testing.assert_allclose(data.qvel, 0.0)
    np.testing.assert_allclose(model.body_mass[1:], 7.5 / 11)


@pytest.mark.parametrize(("scenario", "within"), [(COURSE, 3e-4), (SIDEWINDING, 1e-2)])
def test_it_moves_nearly_as_our_model_does(scenario, within):
    """Half a second: soft contacts shift it by 0.25 mm at the start of the course, in sidewinding by millimetres."""
    run = mujoco_peer.Run(scenario, SpatialSetup(5e-4))
    run.seconds()
    assert np.linalg.norm(run.positions(0.1) - ours(scenario), axis=-1).max() < within


def test_records_are_judged_by_mujocos_own_converged_run(monkeypatch):
    monkeypatch.setattr(mujoco_spatial, "QUICK_REFERENCE_STEPS", (1e-3, 5e-4))
    scene = {
        "kind": "scene",
        "scene": COURSE["name"],
        "title": "3D",
        "scenario": COURSE,
        "reference": {
            "samples": ours(COURSE).tolist(),
            "sample": 0.1,
            "steps": [1e-3, 5e-4],
            "uncertainty": {"end": 1e-7, "worst": 1e-7},
        },
    }
    results = Results.begin("test", quick=True)
    results.add(scene)
    for record in mujoco_peer.points(scene, True, lambda text: None):
        results.add(json.loads(json.dumps(record)))
    peers = results.of("peer")
    assert len(peers) == len(mujoco_spatial.QUICK_STEPS)
    assert peers[0]["apart"]["worst"] < 1e-3
    floor = curves.TRUST * peers[0]["uncertainty"]["worst"]
    assert all(point.error >= floor > 3e-7 for point in curves.points(results, COURSE["name"], "MuJoCo"))
    assert "is judged by its own converged run" in comparison.render(results, "images")
