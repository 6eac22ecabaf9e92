"""What a run records besides its motion: forces that balance the change of momentum, power that integrates to work."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import check_arrays

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, Robot, Scene, Start
from snake_env.obstacles import Box, Circle

MASS = 7.5 / 11.0
MODELS = ("planar", "spatial", "minimal")
METHODS = ("implicit", "thesis")
SUMS = ("ground", "power")
COIL = Gait(amplitude=0.0, gamma=0.9)


def momentum(run):
    """(T, 2 or 3) of the whole robot [kg m/s]."""
    return MASS * run.velocity.sum(axis=1)


def weight(model):
    """Gravity on the robot in the coordinates of its model [N]."""
    return np.array([0.0, 0.0, -9.81 * 7.5]) if model == "spatial" else np.zeros(2)


def ground_force(run):
    """(T, 2 or 3) of the ground on the robot [N]."""
    friction, normal = run.ground_friction.sum(axis=(1, 2)), run.ground_normal.sum(axis=(1, 2))
    return friction if run.position.shape[2] == 2 else np.column_stack([friction, normal])


@pytest.mark.parametrize(("model", "method"), [(model, method) for model in MODELS for method in METHODS])
def test_the_forces_of_an_interval_change_the_momentum(model, method):
    """Sum of forces = sum of m a: exact but for the tolerance of a stage and, in the minimal model and in 3D, for the
    configuration at which velocities are taken, which deviates from the predicted one."""
    scene = Scene(friction=(0.2, 0.5))
    integrator = Integrator(method=method, step=2.5e-3 if method == "implicit" else 2.5e-4)
    run = snake_env.simulate(
        model, scene=scene, integrator=integrator, duration=0.5, sample=0.05, record=["velocity", *SUMS]
    )
    change = np.diff(momentum(run), axis=0)
    impulse = (ground_force(run)[1:] + weight(model)) * 0.05
    scale = np.abs(impulse).max()
    assert scale > 0.01
    np.testing.assert_allclose(change, impulse, atol=2e-3 * max(scale, 1.0))


def test_forces_of_pegs_and_walls_add_up_to_those_on_the_links():
    course = Scene.preset("table-7.5")
    obstacles = [Box((4.0, 0.1), 1.0, -0.25), course.obstacles[0], Circle(0.1, 0.9, 0.25, friction=0.3)]
    run = snake_env.simulate(
        scene=Scene(obstacles=obstacles, friction=(0.2, 0.2)),
        start=Start.on_course(course),
        duration=4.0,
        sample=0.1,
        record=["velocity", "obstacles", "ground"],
    )
    check_arrays(run, obstacle_force=(3, 2))
    np.testing.assert_allclose(run.obstacle_force.sum(axis=1), run.contact_force.sum(axis=1), atol=1e-9)
    assert np.abs(run.obstacle_force).max(axis=(0, 2)).min() > 0.1
    wall, _, rough = run.obstacle_force.swapaxes(0, 1)
    assert np.abs(wall[:, 0]).max() < 1e-9 < wall[:, 1].max()
    assert rough[:, 1].max() < 1.0
    change = np.diff(momentum(run), axis=0)
    force = ground_force(run)[1:] + run.obstacle_force[1:].sum(axis=1)
    np.testing.assert_allclose(change, 0.1 * force, atol=1e-3)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_forces_of_pairs_are_opposite_and_add_up_to_those_on_the_links(model):
    run = snake_env.simulate(
        model,
        gait=COIL,
        controller=PD(torque_limit=30.0),
        start=Start(posture="straight"),
        duration=2.0,
        sample=0.1,
        record="self_contacts",
    )
    assert np.abs(run.pair_force).max() > 1.0
    np.testing.assert_allclose(run.pair_force.sum(axis=2), run.self_contact_force, atol=1e-9)
    np.testing.assert_allclose(run.pair_force, -run.pair_force.swapaxes(1, 2), atol=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_power_integrates_to_work(model):
    """What the actuators give less what friction takes is the gain of energy, up to the dissipation of the scheme,
    which vanishes with the step."""
    errors = []
    for step in (4e-3, 1e-3):
        run = snake_env.simulate(
            model,
            scene=Scene(friction=(0.2, 0.5)),
            integrator=Integrator(step=step),
            duration=1.0,
            sample=0.1,
            record="power",
        )
        work = 0.1 * (run.actuator_power.reshape(11, -1).sum(axis=1) + run.friction_power)
        errors.append(np.abs(np.cumsum(work) - (run.energy - run.energy[0])).max())
        assert run.friction_power.max() <= 0.0
        assert 0.1 * run.actuator_power.sum() > 0.5
    assert errors[1] < 0.02
    assert errors[1] < 0.7 * errors[0]


def test_power_is_torque_times_rate():
    run = snake_env.simulate(duration=1.0, sample=1e-3, integrator=Integrator(step=1e-3), record=["velocity", "power"])
    product = -run.joint_torque * run.joint_rate  # tau_C of (T 3.51) acts on the link before
    np.testing.assert_allclose(run.actuator_power[200:], product[200:], atol=2e-3 * np.abs(product).max())


def test_velocities_are_the_rates_of_the_positions():
    for model in MODELS:
        run = snake_env.simulate(model, duration=0.3, sample=1e-3, integrator=Integrator(step=1e-3), record="velocity")
        mean = (run.position[201:] - run.position[199:-2]) / 2e-3
        np.testing.assert_allclose(run.velocity[200:-1], mean, atol=5e-3)
        rate = (run.joint_angle[201:] - run.joint_angle[199:-2]) / 2e-3
        np.testing.assert_allclose(run.joint_rate[200:-1], rate, atol=2e-2)


def test_nothing_changes_and_nothing_is_held_unasked():
    scene = Scene.preset("table-7.5")
    plain = snake_env.simulate(scene=scene, duration=0.5)
    full = snake_env.simulate(
        scene=scene, duration=0.5, record=["velocity", "ground", "obstacles", "self_contacts", "power"]
    )
    np.testing.assert_array_equal(plain.position, full.position)
    recorded = {name for name, value in vars(full).items() if value is not None and vars(plain)[name] is None}
    assert len(recorded) == 9


@pytest.mark.parametrize("group", ["velocity", "ground", "obstacles", "self_contacts", "power"])
@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_every_group_has_a_row_per_sample_where_there_is_nothing_to_record(model, group):
    """Among no obstacles, of the shortest robot, and named twice."""
    run = snake_env.simulate(model, robot=Robot(links=2), duration=0.02, sample=0.01, record=[group, group])
    assert {len(value) for value in vars(run).values() if isinstance(value, np.ndarray)} == {3}
    if group == "obstacles":
        assert run.obstacle_force.shape == (3, 0, 2 if model == "planar" else 3)


@pytest.mark.parametrize(
    ("keywords", "field"),
    [
        ({"model": "minimal", "record": "obstacles"}, "record[0]"),
        ({"model": "minimal", "record": ["power", "self_contacts"]}, "record[1]"),
        ({"integrator": Integrator(method="thesis"), "record": "self_contacts"}, "record[0]"),
        ({"model": "minimal", "scene": Scene(friction_law="arctan"), "record": "ground"}, "scene.friction_law"),
        ({"record": "heat"}, "record[0]"),
    ],
)
def test_what_a_model_cannot_record_is_refused_by_name(keywords, field):
    with pytest.raises(ConfigError) as refused:
        snake_env.simulate(duration=0.1, **keywords)
    assert refused.value.field == field


def test_a_robot_that_stands_on_a_slope_is_held_by_friction():
    hill = Scene(friction=(0.5, 0.5), slope=(0.2, 0.0))
    run = snake_env.simulate(
        "spatial",
        robot=Robot(links=5),
        scene=hill,
        gait=Gait(amplitude=0.0),
        start=Start(posture="straight"),
        duration=1.0,
        record="ground",
    )
    own = 5 * MASS * 9.81
    np.testing.assert_allclose(np.abs(run.ground_friction[-1].sum(axis=(0, 1))), [own * np.sin(0.2), 0.0], atol=1e-3)
    np.testing.assert_allclose(run.ground_normal[-1].sum(), own * np.cos(0.2), rtol=1e-5)
