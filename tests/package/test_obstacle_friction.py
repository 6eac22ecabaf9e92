"""Coulomb friction at obstacles: closed forms of sliding, sticking and jamming."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Gait, Integrator, Robot, Scene, Start
from snake_env.obstacles import Box, Circle, Segment

STILL = Gait(amplitude=0.0)
RADIUS = 0.0525
GRAVITY = Robot().gravity


def on_a_wall(mu: float, tilt: float, duration: float = 0.5, **changes) -> snake_env.Trajectory:
    """A straight robot on a wall along x, whose weight makes the angle ``tilt`` with the wall; no ground friction."""
    angle = 0.6
    scene = Scene(obstacles=[Segment((-9.0, 0.0), (9.0, 0.0), friction=mu)], friction=(0.0, 0.0), slope=(angle, tilt))
    start = Start(position=(0.0, RADIUS), heading=0.0, posture="straight")
    config = {"robot": Robot(links=3), "duration": duration, "sample": 0.05} | changes
    return snake_env.simulate(scene=scene, gait=STILL, start=start, **config)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.4, 1.0])
@pytest.mark.parametrize("order", [1, 2])
def test_a_robot_slides_along_a_wall_with_its_weight_less_mu_times_the_normal_force(mu, order):
    tilt = 0.6
    run = on_a_wall(mu, tilt, integrator=Integrator(order=order, step=2e-3))
    pull = GRAVITY * math.sin(0.6)
    acceleration = pull * (math.cos(tilt) - mu * math.sin(tilt))
    assert run.position[-1, :, 0] - run.position[0, :, 0] == pytest.approx(-0.5 * acceleration * 0.25, rel=1e-2)
    mass = 3 * 7.5 / 11
    force = run.contact_force[-1].sum(axis=0)
    np.testing.assert_allclose(force, mass * pull * math.sin(tilt) * np.array([mu, 1.0]), rtol=1e-3, atol=1e-6)
    assert run.unconverged.sum() == 0


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10, 1e-12])
def test_friction_at_a_wall_does_not_depend_on_the_tolerance(tolerance):
    """22 contacts share the push of a straight robot in no unique way; what each bears wanders by round-off."""
    run = on_a_wall(0.1, 0.6, robot=Robot(), integrator=Integrator(tolerance=tolerance))
    acceleration = GRAVITY * math.sin(0.6) * (math.cos(0.6) - 0.1 * math.sin(0.6))
    assert run.position[-1, :, 0] - run.position[0, :, 0] == pytest.approx(-0.5 * acceleration * 0.25, rel=1e-3)


def test_a_robot_sticks_to_a_wall_within_the_cone_of_friction():
    run = on_a_wall(0.8, math.atan(1 / 0.7), duration=10.0, sample=1.0)
    assert abs(run.position[-1] - run.position[1]).max() < 1e-9
    mass = 3 * 7.5 / 11
    np.testing.assert_allclose(
        run.contact_force[-1].sum(axis=0)[0], mass * GRAVITY * math.sin(0.6) * math.cos(math.atan(1 / 0.7)), rtol=1e-6
    )


def test_a_box_rubs_as_a_wall_does():
    """A straight robot slides over the flat side of a box as over a wall."""
    scene = Scene(obstacles=[Box((18.0, 0.2), 0.0, -0.1, friction=0.3)], friction=(0.0, 0.0), slope=(0.6, 0.6))
    start = Start(position=(0.0, RADIUS), heading=0.0, posture="straight")
    run = snake_env.simulate(scene=scene, gait=STILL, start=start, robot=Robot(links=3), duration=0.5, sample=0.05)
    wall = on_a_wall(0.3, 0.6)
    np.testing.assert_allclose(run.position, wall.position, atol=1e-6)


def test_friction_at_a_peg_takes_energy_and_never_gives_any():
    gait, start = Gait(), Start.on_course(Scene.preset("table-7.5"))
    pegs = Scene.preset("table-7.5").obstacles
    runs = []
    for mu in (0.0, 0.3):
        scene = Scene(obstacles=[Circle(*peg, friction=mu) for peg in pegs], friction=(0.2, 0.2))
        integrator = Integrator(tolerance=1e-6)
        runs.append(snake_env.simulate(scene=scene, gait=gait, start=start, duration=5.0, integrator=integrator))
    for run in runs:
        assert run.unconverged.sum() == 0
        assert run.residual.max() <= 1e-6
        assert run.max_penetration < 1e-3
    way = [run.position[-1, :, 0].mean() - run.position[0, :, 0].mean() for run in runs]
    assert 0.5 * way[0] < way[1] < way[0]


def test_a_limp_robot_thrown_against_rough_walls_loses_energy_only():
    obstacles = [Segment((-1.0, -2.0), (-1.0, 2.0), friction=0.5), Segment((-2.0, -0.3), (2.0, -0.3), friction=0.5)]
    scene = Scene(obstacles=obstacles, friction=(0.0, 0.0), slope=(0.4, 0.5))
    limp = snake_env.PD(kp=0.0, kd=0.0)
    run = snake_env.simulate(
        scene=scene,
        gait=STILL,
        controller=limp,
        start=Start(heading=0.0, posture="straight"),
        duration=4.0,
        sample=0.01,
    )
    assert np.diff(run.energy).max() < 5e-3
    assert run.energy[-1] < run.energy[0] - 1.0
    assert run.max_penetration < 1e-3


def test_without_friction_nothing_changes():
    courses = [
        Scene.preset("table-7.5"),
        Scene(obstacles=[Circle(*p, friction=0.0) for p in Scene.preset("table-7.5").obstacles]),
    ]
    start = Start.on_course(courses[0])
    runs = [snake_env.simulate(scene=scene, start=start, duration=2.0) for scene in courses]
    np.testing.assert_array_equal(runs[0].position, runs[1].position)


@pytest.mark.parametrize(("model", "method"), [("spatial", "thesis"), ("planar", "thesis")])
def test_what_lacks_friction_at_obstacles_refuses_it(model, method):
    scene = Scene(obstacles=[Circle(0.1, 5.0, 5.0), Circle(0.1, 3.0, 3.0, friction=0.2)])
    message = r'scene\.obstacles\[1\]\.friction = 0\.2: expected 0: friction at obstacles needs model="planar"'
    with pytest.raises(ConfigError, match=message):
        snake_env.simulate(model, scene=scene, integrator=Integrator(method=method))
