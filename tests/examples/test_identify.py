"""What the example of identification finds in logs whose truth is known, and what it does not claim to know."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import snake_env
from snake_env import PD, Integrator, JointTrajectory, Motor, Robot, Scene, Start, Stribeck

NOISE_FREE = {"marker": 0.0, "encoder": 0.0}


@pytest.fixture
def identify(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "examples")
    return pytest.importorskip("identify")


def log_of(identify, scene=None, motor=None, **changes):
    """A noise-free log that the example did not make: another frame, markers beside their links, some unseen."""
    log = identify.synthetic(identify.TRUTH, identify.Noise(**NOISE_FREE), seed=0)
    forward, backward, across, kp, kd, backlash, delay, stall, speed = identify.TRUTH
    run = snake_env.simulate(
        robot=Robot(links=7, backlash=np.radians(backlash), motor=motor or Motor(stall, speed)),
        scene=scene or Scene(friction=(forward, across), friction_backward=backward),
        gait=JointTrajectory(log["time"], log["reference"]),
        controller=PD(kp, kd, **changes),
        start=Start(position=(1.0, -2.0), heading=0.7),
        reference_delay=delay,
        duration=6.0,
        sample=0.05,
        integrator=Integrator(step=identify.INTEGRATION),
    )
    link, (ahead, left) = 4, (0.03, -0.05)
    cosine, sine = np.cos(run.angle[:, link]), np.sin(run.angle[:, link])
    beside = run.position[:, link] + np.stack([ahead * cosine - left * sine, ahead * sine + left * cosine], axis=1)
    marker = np.stack([run.position[:, 0], beside], axis=1)
    marker[10:30, 1] = np.nan
    places = {"marker_link": np.array([0, link]), "marker_offset": np.array([[0.0, 0.0], [ahead, left]])}
    return {"time": run.time, "reference": log["reference"], "joint_angle": run.joint_angle, "marker": marker} | places


def test_parameters_of_a_noise_free_log_are_found(identify):
    """Within 0.5 %: the log's references come late by other samples than the fit's, every 5 ms."""
    found = identify.fit(log_of(identify), identify.Noise())
    np.testing.assert_allclose(found.values, identify.TRUTH, rtol=5e-3)
    assert not found.warnings


def test_intervals_hold_the_truth_under_noise(identify):
    """Estimates of four logs scatter about the truth as their standard errors say: a chi-square of 36 values.

    The fits begin at the truth, which saves iterations.
    """
    noise, truth = identify.Noise(), identify.TRUTH
    fits = [identify.fit(identify.synthetic(truth, noise, seed), noise, guess=truth) for seed in range(4)]
    scatter = np.array([(found.values - truth) / found.standard_errors for found in fits])
    assert abs(scatter).max() < 3.5
    assert 0.4 < np.mean(scatter**2) < 2.0
    assert not any(found.warnings for found in fits)


def test_what_a_robot_at_rest_does_not_show_is_named(identify):
    log = identify.synthetic(identify.TRUTH, identify.Noise(), seed=0, amplitude=0.0)
    found = identify.fit(log, identify.Noise())
    for name in identify.NAMES:
        assert any("cannot be told" in text and name in text for text in found.warnings), name
    np.testing.assert_array_equal(found.values, identify.GUESS)


def test_a_direction_that_cannot_be_told_names_all_of_its_parameters(identify):
    """Two parameters with opposite effects: only their difference is known."""
    rng, count = np.random.default_rng(0), len(identify.NAMES)
    columns = 100.0 * np.linalg.qr(rng.standard_normal((600, count)))[0]
    columns[:, 1] = -columns[:, 0]
    errors = rng.standard_normal((60, 10))
    found = identify.judged(identify.NAMES, identify.TRUTH, identify.TRUTH, columns, errors, np.zeros(count, bool))
    assert found.warnings in [
        [f"cannot be told within its own size: friction forward ({sign}0.71), friction backward ({sign}0.71)"]
        for sign in "+-"
    ]
    assert max(found.standard_errors[2:] / identify.TRUTH[2:]) < 0.02


def test_gains_too_stiff_for_the_encoders_are_named(identify):
    """Their columns of the Jacobian are errors of the simulations."""
    truth = identify.TRUTH * np.array([1, 1, 1, 50, 2, 1, 1, 1, 1])
    found = identify.fit(identify.synthetic(truth, identify.Noise(), seed=0), identify.Noise())
    assert any("kp" in text for text in found.warnings)


def test_a_motor_that_never_limits_the_torque_is_named_and_the_rest_is_found(identify):
    strong = Motor(stall_torque=500.0, no_load_speed=500.0)
    found = identify.fit(log_of(identify, motor=strong), identify.Noise())
    for name in ("stall torque", "no-load speed"):
        assert any(name in text for text in found.warnings), name
    np.testing.assert_allclose(found.values[:7], identify.TRUTH[:7], rtol=0.02)


def test_friction_backward_is_named_where_nothing_slides_backward(identify):
    """Without a wave that runs back links slide forward only."""
    log = identify.synthetic(identify.TRUTH, identify.Noise(), seed=0)
    first = log["time"] <= 1.5
    log |= {name: log[name][first] for name in ("time", "reference", "joint_angle", "marker")}
    found = identify.fit(log, identify.Noise(), guess=identify.TRUTH)
    before = found.standard_errors / found.values
    log = identify.synthetic(identify.TRUTH, identify.Noise(), seed=0)
    whole = identify.fit(log, identify.Noise(), guess=identify.TRUTH)
    after = whole.standard_errors / whole.values
    assert before[1] > 5.0 * after[1]


def test_what_is_held_keeps_its_value(identify):
    """A robot whose motors are known to have no limit."""
    names = [name for name in identify.NAMES if name not in ("stall torque", "no-load speed")]
    guess = np.append(identify.GUESS[:7], [np.inf, np.inf])
    found = identify.fit(log_of(identify, motor=Motor()), identify.Noise(), guess, names)
    np.testing.assert_allclose(found.values, identify.TRUTH[:7], rtol=5e-3)
    assert not found.warnings


def test_a_model_that_is_not_the_robots_is_noticed(identify):
    forward, backward, across = identify.TRUTH[:3]
    slippery = Scene(friction=(forward, across), friction_backward=backward, stribeck=Stribeck(drop=0.6, speed=0.05))
    found = identify.fit(log_of(identify, slippery, torque_limit=1.0), identify.Noise())
    assert any("wrong model" in text for text in found.warnings)


def test_the_command_prints_a_row_per_parameter(identify, tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    log = identify.synthetic(identify.TRUTH, identify.Noise(), seed=0, links=4, duration=2.0)
    np.savez(tmp_path / "log.npz", **log)
    arguments = ["identify.py", "--log", str(tmp_path / "log.npz"), "--plot", str(tmp_path / "errors.png")]
    monkeypatch.setattr("sys.argv", arguments)
    identify.main()
    printed = capsys.readouterr().out
    assert all(f"\n{name}" in printed for name in identify.NAMES)
    assert (tmp_path / "errors.png").stat().st_size > 1000
