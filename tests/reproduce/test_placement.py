"""The geometry from which pegs are placed for a gait."""

import math

import numpy as np
import pytest

import snake_env
from snake_env.reproduce import placement
from snake_env.reproduce.serpenoid import NaturalPath

DEGREE = math.pi / 180.0
GAITS = [snake_env.Gait(beta=beta * DEGREE) for beta in (-30, -50, -70)]


def chain(path, gait, phase, robot):
    """CGs and forward directions of the links, put together joint by joint from link 1 on its path."""
    joints = gait.amplitude * np.sin(phase + np.arange(robot.links - 1) * gait.beta)
    theta = math.pi + float(path.direction(phase)) + np.concatenate([[0.0], np.cumsum(joints)])
    half = 0.5 * robot.length * np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    steps = half[:-1] + half[1:]
    return path.position(phase) + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), theta


@pytest.mark.parametrize("gait", GAITS, ids=str)
def test_every_link_is_on_the_natural_path(gait):
    """The path solves the chain's geometry exactly; linear interpolation between samples is off by < 1 um."""
    robot = snake_env.Robot()
    path = NaturalPath(gait, robot.length)
    for phase in (0.0, 0.4, 3.0):
        position, theta = chain(path, gait, phase, robot)
        phases = phase + gait.beta * np.arange(robot.links)
        np.testing.assert_allclose(position, path.position(phases), atol=1e-6)
        np.testing.assert_allclose(theta, math.pi + path.direction(phases), atol=1e-9)


def test_the_no_slip_bound_is_that_of_a_bessel_function():
    """J_0(0.826) = 0.8365 by its series; the thesis's gait cannot exceed 0.1633 m/s."""
    gait = snake_env.Gait()
    path = NaturalPath(gait, 0.122)
    half = 0.5 * path.swing
    bessel = sum((-1) ** k * half ** (2 * k) / math.factorial(k) ** 2 for k in range(12))
    assert path.no_slip_speed == pytest.approx(0.122 * gait.omega / -gait.beta * bessel, rel=1e-12)
    assert path.no_slip_speed == pytest.approx(0.1633, abs=5e-5)


def test_half_a_wave_is_the_spacing_of_table_7_5():
    """Its seven pegs, printed to a millimetre, lie half a wave apart."""
    pegs = snake_env.Scene.preset("table-7.5").obstacles
    assert NaturalPath(snake_env.Gait(), 0.122).half_wave == pytest.approx((pegs[6][1] - pegs[0][1]) / 6, abs=1e-3)


@pytest.mark.parametrize("gait", GAITS, ids=str)
def test_placed_pegs_clear_the_robot_all_along_and_no_more_than_needed(gait):
    robot = snake_env.Robot()
    path = NaturalPath(gait, robot.length)
    scene, start = placement.course(gait)
    pegs = np.array(scene.obstacles)
    smallest = math.inf
    for phase in np.linspace(0.0, 2.0 * math.pi, 60):
        position, theta = chain(path, gait, phase, robot)
        smallest = min(smallest, gaps(position, theta, pegs, robot).min())
    # The search moves a peg in steps of a millimetre.
    assert placement.CLEARANCE - 2e-4 < smallest < placement.CLEARANCE + 1e-3
    assert start.position[0] == pytest.approx(0.0, abs=0.1)


def gaps(position, theta, pegs, robot):
    """Distances of outlines and pegs (links, pegs) [m], by plain geometry."""
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)[:, None]
    offset = pegs[None, :, 1:] - position[:, None]
    length = robot.contact_half_length
    nearest = np.clip((offset * along).sum(-1, keepdims=True), -length, length)
    return np.linalg.norm(offset - nearest * along, axis=-1) - robot.radius - pegs[None, :, 0]


def test_pegs_repeat_half_a_wave_apart_on_alternating_sides_near_the_centre_line():
    for gait in GAITS:
        path = NaturalPath(gait, 0.122)
        pegs = np.array(placement.course(gait)[0].obstacles)
        np.testing.assert_allclose(np.diff(pegs[:, 1]), path.half_wave, atol=1e-5)
        np.testing.assert_allclose(pegs[1:, 2], -pegs[:-1, 2], atol=1e-9)
        assert np.all(np.abs(pegs[:, 2]) < 0.05)


def test_placed_pegs_push_forward():
    """Obstacle 1 of Fig. 5.2: on the flank after a bend, so the reaction on the body points forward."""
    gait = snake_env.Gait()
    scene, start = placement.course(gait)
    run = snake_env.simulate(scene=scene, gait=gait, start=start, duration=6.0, sample=0.05)
    force = run.contact_force[40:]
    assert np.all(force[..., 0].sum(axis=1) >= 0.0)
    assert (np.linalg.norm(force, axis=-1) > 0.3).sum(axis=1).max() >= 3


def test_pegs_too_large_for_the_gait_are_refused():
    with pytest.raises(ValueError, match="radius = 3"):
        placement.course(snake_env.Gait(), radius=3.0)


def test_only_waves_to_the_tail_have_a_natural_path():
    with pytest.raises(ValueError, match="beta < 0"):
        NaturalPath(snake_env.Gait(beta=0.8), 0.122)
