"""The scripted run: shapes, sampling, interruption."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import check_arrays

import snake_env
from snake_env import PD, DivergenceError, Integrator, Robot, Scene, Start, minimal
from snake_env.obstacles import Box


def test_arrays_have_the_promised_shapes_and_layout():
    links, rows = 7, 6
    run = snake_env.simulate(robot=Robot(links=links), duration=0.5, sample=0.1)
    joints, forces = (links - 1,), (links, 2)
    check_arrays(run, position=forces, angle=(links,), joint_angle=joints, joint_torque=joints, contact_force=forces)
    np.testing.assert_allclose(run.time, np.arange(rows) * 0.1, rtol=1e-15)
    np.testing.assert_allclose(np.diff(run.angle, axis=1), run.joint_angle, atol=1e-15)
    assert isinstance(run.max_joint_gap, float)
    assert isinstance(run.max_penetration, float)


def test_row_zero_is_the_start():
    start = Start(position=(0.3, -0.2), heading=1.0, posture=[0.1] * 10)
    run = snake_env.simulate(start=start, duration=0.1)
    np.testing.assert_array_equal(run.position[0, 0], [0.3, -0.2])
    np.testing.assert_allclose(run.joint_angle[0], 0.1, atol=1e-15)
    assert (run.angle[0, 0], run.energy[0], run.iterations[0]) == (1.0, 0.0, 0.0)
    straight = snake_env.simulate(start=Start(posture="straight"), duration=0.1)
    assert not straight.joint_angle[0].any()


def test_a_preset_course_has_its_own_start():
    scene = Scene.preset("table-7.5")
    one = snake_env.simulate(scene=scene, duration=0.1)
    other = snake_env.simulate(scene=scene, start=Start.on_course(scene), duration=0.1)
    np.testing.assert_array_equal(one.position, other.position)


@pytest.mark.parametrize(
    ("duration", "sample", "rows"), [(1.0, 0.1, 11), (0.95, 0.1, 10), (0.3, 0.1, 4), (1e-3, 1e-3, 2)]
)
def test_the_last_sample_is_the_last_multiple_within_the_duration(duration, sample, rows):
    assert len(snake_env.simulate(duration=duration, sample=sample).time) == rows


def test_samples_do_not_depend_on_how_often_one_looks():
    integrator = Integrator(step=0.01)
    often = snake_env.simulate(integrator=integrator, duration=0.4, sample=0.02)
    seldom = snake_env.simulate(integrator=integrator, duration=0.4, sample=0.2)
    np.testing.assert_allclose(often.position[::10], seldom.position, atol=1e-12)


def test_a_run_that_diverges_reports_when():
    """The thesis's explicit PD is unstable at twice its step (k_P = 800, k_D = 2)."""
    with pytest.raises(DivergenceError, match="diverged at t =") as caught:
        snake_env.simulate(integrator=Integrator(method="thesis", step=2e-3), controller=PD(), duration=5.0)
    assert 0.0 <= caught.value.time < 5.0


def test_a_long_run_can_be_interrupted():
    code = "import snake_env; print('go', flush=True); snake_env.simulate(duration=1e6, sample=1.0)"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout.readline().strip() == "go"
        time.sleep(0.5)
        run.send_signal(signal.SIGINT)
        try:
            _, errors = run.communicate(timeout=60)  # to its end it would take minutes
        finally:
            run.kill()
    assert "KeyboardInterrupt" in errors


@pytest.mark.parametrize("model", ["planar", "spatial", "minimal"])
def test_a_soft_start_counts_from_when_the_actuators_are_switched_on(model):
    """Joints wait at zero after 1 s, though the waves of joints 1, 2, 5, 6 and 9 passed through zero before."""
    gait = snake_env.Gait.lateral_undulation(soft_start=True)
    controller, straight = PD(active_from=1.0), Start(posture="straight")
    fine = Integrator(step=2.5e-4)
    run = snake_env.simulate(
        model, gait=gait, controller=controller, integrator=fine, start=straight, duration=1.4, sample=1e-3
    )
    angle = run.joint_angle[..., 0] if model == "spatial" else run.joint_angle
    reference = gait.reference(run.time, start_up=1.0)["angle"]
    waiting = ~reference.any(axis=0)
    assert np.flatnonzero(~waiting).tolist() == [2, 9], "the waves of joints 10 and 3 come by in this time"
    assert not run.joint_torque[run.time < 1.0 - 1e-9].any()
    assert np.abs(angle[:, waiting]).max() < np.radians(1.0)
    # A step of 3 degrees and the rate of the wave, k_P 3 deg + k_D A omega = 44 N m, at most.
    assert 5.0 < np.abs(run.joint_torque).max() < 44.0
    np.testing.assert_allclose(angle[-1], reference[-1], atol=np.radians(1.0))


def test_a_reference_without_soft_start_does_not_depend_on_start_up():
    gait, time = snake_env.Gait(), [0.0, 0.7, 3.0]
    np.testing.assert_array_equal(gait.reference(time, start_up=2.0)["angle"], gait.reference(time)["angle"])
    with pytest.raises(snake_env.ConfigError, match="start_up"):
        gait.reference(time, start_up=-1.0)


@pytest.mark.parametrize(("model", "scene"), [("planar", Scene()), ("minimal", minimal.TABLE_7_2_GROUND)])
def test_a_run_keeps_the_robot_and_the_scene_that_it_had(model, scene):
    run = snake_env.simulate(model, duration=0.1)
    assert (run.robot, run.scene) == (Robot(), scene)
    told = snake_env.simulate(model, robot=Robot(), scene=scene, duration=0.1)
    np.testing.assert_array_equal(run.position, told.position)


def test_a_run_from_mappings_keeps_a_robot_and_a_scene():
    obstacles = [(0.1, 1.0, 0.0), {"shape": "box", "size": [0.2, 0.1], "x": 2.0, "y": 0.0}]
    run = snake_env.simulate(
        robot={"links": 3, "radius": 0.02},
        scene={"obstacles": obstacles, "stribeck": {"drop": 0.1}},
        self_contact=False,
        duration=0.1,
    )
    assert run.robot == Robot(links=3, radius=0.02, self_contact=False)
    assert run.scene == Scene(obstacles=[obstacles[0], Box((0.2, 0.1), 2.0, 0.0)], stribeck=snake_env.Stribeck(0.1))
    same = snake_env.simulate(robot=run.robot, scene=run.scene, duration=0.1)
    np.testing.assert_array_equal(run.position, same.position)
