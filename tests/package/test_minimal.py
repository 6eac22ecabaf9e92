"""The minimal model (T ch. 6) from Python: its matrices, and runs under both controllers."""

import dataclasses

import numpy as np
import pytest

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, IOLinearizing, Noise, Robot, Scene, Start, minimal
from snake_env.reproduce import stability, theorem

SOFT = Gait(soft_start=True)
STRAIGHT = Start(position=(0.061, 0.0), heading=0.0, posture="straight")


def run(duration=6.0, **keywords):
    defaults = {"model": "minimal", "gait": SOFT, "start": STRAIGHT, "sample": 0.05}
    return snake_env.simulate(duration=duration, **(defaults | keywords))


def error(trajectory):
    """Largest |phi - phi_d| of joint 5 after 5 s [deg]."""
    errors = trajectory.joint_angle - SOFT.reference(trajectory.time)["angle"]
    return np.degrees(np.abs(errors[trajectory.time >= 5.0, 4]).max())


@pytest.fixture(scope="module")
def state():
    rng = np.random.default_rng(1)
    return rng.uniform(-1.0, 1.0, 13), rng.uniform(-2.0, 2.0, 13)


def turned(theta):
    return np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])


def test_shapes_are_those_of_the_docstrings(state):
    q, qdot = state
    plant = minimal.process_plant(q, qdot)
    assert (plant.M.shape, plant.C.shape, plant.friction.shape) == ((13, 13), (13, 13), (13,))
    assert plant.J_G.shape == plant.J_F.shape == plant.J_R.shape == (11, 2, 13)
    assert plant.F_F.shape == plant.F_R.shape == (11, 2)
    control = minimal.control_plant(q[3:], qdot)
    assert (control.M11.shape, control.M12.shape, control.M22_bar.shape) == ((3, 3), (3, 10), (10, 10))
    assert (control.h.shape, control.g.shape, control.h2_bar.shape, control.g2_bar.shape) == (
        (13,),
        (13,),
        (10,),
        (10,),
    )
    assert all(array.flags.c_contiguous for array in (*plant, *control))


def test_the_named_arrays_fit_together(state):
    """(6.15) without rotation is J_G^T m J_G; (6.37)-(6.57) follow from the arrays they are made of."""
    q, nu = state
    plant = minimal.process_plant(q, nu)
    rotation = np.array([[float(2 <= k <= i + 2) for k in range(13)] for i in range(11)])
    mass = 7.5 / 11 * np.einsum("iak,ial->kl", plant.J_G, plant.J_G) + 1.32e-3 * rotation.T @ rotation
    np.testing.assert_allclose(plant.M, mass, rtol=1e-12, atol=1e-12)
    friction = np.einsum("iak,ia->k", plant.J_F, plant.F_F) + np.einsum("iak,ia->k", plant.J_R, plant.F_R)
    np.testing.assert_allclose(plant.friction, friction, atol=1e-12)
    control = minimal.control_plant(q[3:], nu)
    np.testing.assert_allclose(control.M, np.block([[control.M11, control.M12], [control.M21, control.M22]]))
    np.testing.assert_allclose(control.h, control.C @ nu, atol=1e-12)
    coupling = control.M21 @ np.linalg.inv(control.M11)
    np.testing.assert_allclose(control.M22_bar, control.M22 - coupling @ control.M12, atol=1e-12)
    np.testing.assert_allclose(control.h2_bar, control.h[3:] - coupling @ control.h[:3], atol=1e-12)
    np.testing.assert_allclose(control.g2_bar, control.g[3:] - coupling @ control.g[:3], atol=1e-12)


def test_both_plants_describe_one_robot(state):
    q, nu = state
    transform = np.eye(13)
    transform[:2, :2] = turned(q[2])
    plant, control = minimal.process_plant(q, transform @ nu), minimal.control_plant(q[3:], nu)
    np.testing.assert_allclose(control.M, transform.T @ plant.M @ transform, atol=1e-12)
    np.testing.assert_allclose(control.g, transform.T @ plant.friction, atol=1e-12)
    np.testing.assert_allclose(control.F_F, plant.F_F @ turned(q[2]), atol=1e-12)


def test_bad_states_are_named():
    with pytest.raises(ConfigError, match=r"phi = "):
        minimal.control_plant(np.zeros(9), np.zeros(13))
    with pytest.raises(ConfigError, match=r"qdot\[0\] = nan"):
        minimal.process_plant(np.zeros(13), np.full(13, np.nan))
    with pytest.raises(ConfigError, match=r"scene\.friction_law"):
        minimal.process_plant(np.zeros(13), np.zeros(13), scene=Scene())
    assert minimal.process_plant(np.zeros(5), np.zeros(5), robot=Robot(links=3)).M.shape == (5, 5)


def test_a_run_has_the_arrays_of_any_other_and_the_velocities_of_the_virtual_joints():
    trajectory = run(0.5, robot=Robot(links=7), sample=0.1)
    assert trajectory.position.shape == (6, 7, 2)
    assert trajectory.joint_torque.shape == (6, 6)
    assert trajectory.passive_velocity.shape == (6, 3)
    np.testing.assert_allclose(trajectory.position[0, 0], [0.061, 0.0], atol=1e-15)
    np.testing.assert_allclose(np.diff(trajectory.angle, axis=1), trajectory.joint_angle, atol=1e-12)
    assert not trajectory.contact_force.any()
    assert (trajectory.max_joint_gap, trajectory.max_penetration) == (0.0, 0.0)


def test_defaults_are_the_thesis_values():
    plain = run(1.0)
    ground = Scene(friction=(0.2, 0.5), viscous=(0.1, 0.2))
    explicit = run(1.0, scene=ground, controller=PD(kp=200.0, kd=1.2), integrator=Integrator(step=0.02))
    np.testing.assert_array_equal(plain.position, explicit.position)


def test_joint_torque_drives_the_joint_angle_up():
    trajectory = run(0.1, gait=Gait(amplitude=0.0), start=dataclasses.replace(STRAIGHT, posture=[-0.1] * 10))
    assert trajectory.joint_torque[1].mean() > 0.0
    assert trajectory.joint_angle[-1].mean() > trajectory.joint_angle[0].mean()


@pytest.mark.parametrize("law", ["set-valued", "arctan", "ellipse"])
def test_input_output_linearisation_tracks_better_than_pd_under_every_law(law):
    scene = Scene(friction=(0.2, 0.5), viscous=(0.1, 0.2), friction_law=law)
    io, pd = (run(scene=scene, controller=controller) for controller in (IOLinearizing(), PD(200.0, 1.2)))
    assert error(io) < 0.02 * error(pd)
    assert not io.unconverged.any()


def test_set_valued_runs_are_certified():
    assert run(controller=IOLinearizing(), integrator=Integrator(step=0.05)).residual.max() < 1e-6


def test_noise_is_seeded_and_needs_torque():
    keywords = {"duration": 0.5, "noise": Noise.table_7_4("b"), "integrator": Integrator(step=2.5e-4)}
    keywords["gait"] = Gait(amplitude=0.0)
    one, same, other = (run(seed=seed, controller=IOLinearizing(), **keywords) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.position, same.position)
    assert (one.position != other.position).any()
    assert one.joint_torque[1:].std() > 10.0


@pytest.mark.parametrize("law", ["set-valued", "arctan"])
def test_noise_is_measured_every_quarter_of_a_millisecond_by_default(law):
    scene = Scene(friction=(0.2, 0.5), viscous=(0.1, 0.2), friction_law=law)
    keywords = {"duration": 0.2, "noise": Noise.table_7_4("b"), "scene": scene}
    plain, sampled = (run(controller=IOLinearizing(**more), **keywords) for more in ({}, {"treatment": 2.5e-4}))
    np.testing.assert_array_equal(plain.position, sampled.position)


def test_table_7_4():
    degree = np.pi / 180
    assert Noise.table_7_4("b") == Noise(0.1, 0.1 * degree, 0.1 * degree, 0.1, 0.1 * degree, 0.1 * degree)
    assert Noise.table_7_4("d") == Noise(10.0, 10 * degree, degree, 10.0, 10 * degree, degree)
    with pytest.raises(ConfigError, match="table_7_4"):
        Noise.table_7_4("a")


def test_gains_from_the_control_period():
    controller = IOLinearizing.for_period(0.01, torque_limit=10.0)
    assert (controller.kd, controller.kp, controller.treatment) == (50.0, 625.0, 0.01)
    assert controller.torque_limit == 10.0
    with pytest.raises(ConfigError, match=r"controller\.period"):
        IOLinearizing.for_period(0.0)


def test_the_reference_is_that_of_the_gait():
    reference = SOFT.reference([0.0, 10.0])
    np.testing.assert_allclose(reference["angle"][0], 0.0)
    phase = SOFT.omega * 10.0 + SOFT.beta * np.arange(10)
    np.testing.assert_allclose(reference["angle"][1], SOFT.amplitude * np.sin(phase), atol=1e-14)
    np.testing.assert_allclose(reference["rate"][1], SOFT.amplitude * SOFT.omega * np.cos(phase), atol=1e-14)


def test_the_mobility_behind_the_theory_of_sampled_pd():
    straight = minimal.control_plant(np.zeros(10), np.zeros(13))
    assert np.linalg.eigvalsh(np.linalg.inv(straight.M22_bar))[-1] == pytest.approx(stability.MOBILITY, rel=1e-3)


def test_the_condition_of_theorem_6_1_is_far_from_the_gait():
    assert theorem.bound(Gait()).rate == pytest.approx(0.055, abs=1e-3)
    assert theorem.reference_speed(Gait()) == pytest.approx(2.27, abs=0.01)
