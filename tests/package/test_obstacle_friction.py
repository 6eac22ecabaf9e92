"""Coulomb friction at obstacles: closed forms of sliding, sticking and jamming."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, Robot, Scene, Start
from snake_env.obstacles import Box, Circle, Cylinder, Segment

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


def test_a_stage_that_is_not_solved_to_its_tolerance_ends_with_the_best_solution_found():
    """Round-off does not allow 1e-12 m/s; a fallback that then gave up opening the contacts was off by 5 mm."""
    folding = Gait(amplitude=0.0, gamma=1.0)

    def folded(tolerance: float) -> snake_env.Trajectory:
        return snake_env.simulate(
            scene=Scene(friction=(0.2, 0.4)),
            start=Start(posture="straight"),
            gait=folding,
            controller=PD(torque_limit=6.0),
            integrator=Integrator(tolerance=tolerance),
            duration=0.4,
            sample=0.1,
        )

    with pytest.warns(UserWarning, match="ended before their tolerance"):
        run = folded(1e-12)
    assert run.unconverged.sum() > 0
    assert run.residual.max() < 1e-8
    assert abs(run.position - folded(1e-9).position).max() < 1e-7


@pytest.mark.parametrize(("mu", "half_width"), [(1.23, 0.12), (2.0, 0.115), (2.0, 0.11)])
def test_a_jam_between_rough_walls_is_solved_in_short_steps(mu, half_width):
    """No step of them takes 2,000 linear solves."""
    walls = [Segment((-0.6, y), (0.95, y), friction=mu) for y in (-half_width, half_width)]
    run = snake_env.simulate(
        robot=Robot(links=5, mass=(4.08, 0.68, 0.68, 0.68, 0.136)),
        scene=Scene(obstacles=walls, friction=(0.05, 0.13)),
        gait=Gait(amplitude=1.0, omega=3.5, beta=-0.83, gamma=-0.3),
        controller=PD(kp=50.0, kd=2.0, torque_limit=10.0),
        start=Start(position=(-0.05, 0.0), heading=0.0, posture="straight"),
        integrator=Integrator(step=1e-3),
        duration=0.6,
        sample=1e-3,
    )
    assert run.iterations.max() < 2_000
    assert run.unconverged.sum() == 0
    assert run.residual.max() <= 1e-4


@pytest.mark.parametrize("step", [25e-3, 5e-3, 1e-3])
def test_links_that_wedge_themselves_between_rough_pegs_are_held_by_ordinary_forces(step):
    """Motors of 10 N m do not make forces of millions of newtons, and friction takes no more work than they give."""
    pegs = [(-0.2, 0.14314), (0.02, -0.15475), (0.24, 0.16371), (0.46, -0.12581)]
    run = snake_env.simulate(
        robot=Robot(
            links=5,
            mass=(4.08, 0.68, 0.68, 0.68, 0.136),
            inertia=(7.8e-3, 1.3e-3, 1.3e-3, 1.3e-3, 2.6e-4),
            joint_limit=0.9,
        ),
        scene=Scene(obstacles=[Circle(0.06, x, y, friction=1.29) for x, y in pegs], friction=(0.11, 0.206)),
        gait=Gait(amplitude=0.892, omega=4.78, beta=0.781, gamma=-0.281),
        controller=PD(kp=800.0, kd=2.0, torque_limit=10.0),
        start=Start(position=(-0.05, 0.0), heading=0.0, posture="straight"),
        integrator=Integrator(step=step),
        duration=1.5,
        sample=25e-3,
        record=["power"],
    )
    assert run.unconverged.sum() == 0
    assert abs(run.contact_force).max() < 1e4
    assert -run.friction_power.sum() < run.actuator_power.sum()


@pytest.mark.parametrize("step", [10e-3, 5e-3, 2.5e-3])
def test_a_limp_chain_that_falls_between_rough_poles_is_held(step):
    poles = [Cylinder((-1.0, y, 0.3), (1.0, y, 0.3), 0.08, friction=0.548) for y in (-0.13173, 0.13173)]
    run = snake_env.simulate(
        model="spatial",
        robot=Robot(links=3),
        scene=Scene(obstacles=poles, friction=(0.548, 0.548)),
        controller=PD(kp=0.0, kd=0.0),
        gait=Gait(amplitude=0.0),
        start=Start(position=(-0.122, 0.0113, 0.7016), heading=-0.00423, pitch=0.0579, posture="straight"),
        integrator=Integrator(step=step),
        duration=0.6,
        sample=1e-2,
    )
    assert run.unconverged.sum() == 0
    assert abs(run.contact_force).max() < 1e3
    # Its middle link rests on both.
    assert run.position[-1, 1, 2] > 0.3
    assert abs(run.position[-1] - run.position[-5]).max() < 1e-4


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_robot_with_too_little_room_between_rough_pegs_is_not_shot_out(model):
    """Pegs on both sides demand that the same links make way. Steps run out of solves, and what is left is calm."""
    sides = [(0.3, 0.09), (0.7, 0.095)]
    with pytest.warns(UserWarning, match="solves ended before their tolerance"):
        run = snake_env.simulate(
            model=model,
            scene=Scene(obstacles=[Circle(0.05, x, s * y, friction=0.5) for x, y in sides for s in (1, -1)]),
            start=Start(position=(-0.05, 0.0), heading=0.0, posture="straight"),
            controller=PD(torque_limit=10.0),
            integrator=Integrator(step=5e-3),
            duration=0.025,
            sample=5e-3,
        )
    # Pegs push links out at 0.2 m/s.
    assert run.residual.max() < 1.0
    assert abs(run.position[1:] - run.position[:-1]).max() < 5e-3 * 5.0


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


STEPS = [25e-3, 5e-3, 1e-3, 5e-4]


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("tilt", [0.6, 1.2])
def test_a_rod_dropped_on_a_very_rough_floor_is_solved_in_steps_of_any_length(step, tilt):
    """With mu = 8 friction lifts one end as the other lands."""
    robot = Robot(links=2, locked=(0,))
    run = snake_env.simulate(
        robot=robot,
        scene=Scene(
            obstacles=[Segment((-9.0, 0.0), (9.0, 0.0), friction=8.0)], friction=(0.0, 0.0), slope=(math.pi / 2,) * 2
        ),
        gait=STILL,
        integrator=Integrator(step=step),
        start=Start(position=(0.0, RADIUS + 0.1 + 0.2 * math.sin(tilt)), heading=tilt, posture=[0.0]),
        duration=0.5,
    )
    assert run.unconverged.sum() == 0
    assert run.max_penetration < 1e-6
    np.testing.assert_allclose(run.position[-1, :, 1], RADIUS, atol=1e-6)


def limp_over_a_circle(mu: float, load: float, around: int, step: float) -> snake_env.Trajectory:
    """A limp chain whose links lie ``around`` half a rough circle, three hang down before and five behind it; the last
    one has ``load`` times the mass of the others."""
    length, turn, before, behind = 0.122, math.pi / around, 3, 5
    away = 0.5 * length / math.tan(0.5 * turn)
    links = before + around + 1 + behind
    weights = [*[1.0] * (links - 1), load]
    aiko = Robot()
    return snake_env.simulate(
        robot=Robot(
            links=links,
            mass=[aiko.mass * weight for weight in weights],
            inertia=[aiko.inertia * weight for weight in weights],
            limp=range(links - 1),
        ),
        scene=Scene(
            obstacles=[Circle(away - RADIUS, 0.0, 0.0, friction=mu)], friction=(0.0, 0.0), slope=(math.pi / 2,) * 2
        ),
        gait=STILL,
        integrator=Integrator(step=step),
        start=Start(
            position=(-away, -before * length),
            heading=math.pi / 2,
            posture=[*[0.0] * before, *[-turn] * around, *[0.0] * behind],
        ),
        duration=0.5,
    )


@pytest.mark.parametrize("step", [5e-3, 1e-3, 5e-4])
@pytest.mark.parametrize(("mu", "load", "around"), [(0.3, 6.0, 16), (0.6, 2.0, 16), (0.6, 6.0, 16), (0.3, 2.0, 9)])
def test_a_limp_chain_over_a_rough_circle_is_held(mu, load, around, step):
    """Its hanging ends pull with less than the ratio e^(mu pi) that a rope would bear."""
    run = limp_over_a_circle(mu, load, around, step)
    assert run.unconverged.sum() == 0
    assert abs(run.position[-1] - run.position[0]).max() < 2e-5


@pytest.mark.parametrize("mu", [0.3, 0.6, 1.0])
def test_random_joint_actions_among_rough_pegs_leave_no_stage_unconverged(mu):
    pegs = Scene.preset("table-7.5")
    env = snake_env.SnakeVectorEnv(
        8,
        task="course",
        action_mode="joints",
        scene=Scene(obstacles=[Circle(*peg, friction=mu) for peg in pegs.obstacles]),
        start=Start.on_course(pegs),
    )
    env.reset(seed=1)
    rng = np.random.default_rng(1)
    for _ in range(60):
        *_, info = env.step(rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32))
        assert not info["misses"].any()
        assert not info["penetrated"].any()


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
