"""Friction that differs forward and backward: a crawl in closed form, an independent simulation, refusals."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import snake_env
from snake_env import PD, ConfigError, Gait, Integrator, IOLinearizing, Randomization, Robot, Scene, Start

SCALES = Scene(friction=(0.1, 0.6), friction_backward=0.3)
REVERSED = Scene(friction=(0.3, 0.6), friction_backward=0.1)
PLAIN = Scene(friction=(0.2, 0.6))
LENGTH = Robot().length


def bending(scene, amplitude, model="planar"):
    """Advance per period of a robot of three links that bends to one side and the other; the amplitude reached."""
    period = 2 * np.pi
    run = snake_env.simulate(
        model=model,
        robot=Robot(links=3),
        scene=scene,
        gait=Gait(amplitude=amplitude, omega=1.0, beta=0.0, gamma=0.0),
        start=Start(position=(0.0, 0.0), heading=np.pi),  # forward, towards link 1, is to +x
        duration=4 * period,
        sample=period / 40,
    )
    moved = np.diff(run.position[::40, :, 0].mean(axis=1))
    return moved[1:], np.abs(run.joint_angle[40:]).max()


@pytest.mark.parametrize("amplitude", [0.1, 0.2, 0.4])
def test_a_bending_robot_crawls_by_what_bending_shortens_it(amplitude):
    """Two joints with the angle phi = A sin(t): the outer CGs are L (1 + cos phi) apart along the robot.

    Moving slowly, forces balance. Across: the outer links bear half the friction mu_n N of the middle one, which
    slides across at O(A), so they do not slide across but for O(A^2), and along they resist with
    mu sqrt(1 - 1/4) N. The middle link's part along is O(A) of that. So while the robot bends, the front link, which
    would slide backward, rests, since mu_b > mu_f, and the rear one slides forward by L (1 - cos A); while it
    straightens the roles are exchanged. In a period both happen twice: the robot advances by 2 L (1 - cos A), whatever
    the coefficients, and with an ellipse by 0.
    """
    moved, reached = bending(SCALES, amplitude)
    expected = 2 * LENGTH * (1 - np.cos(reached))
    assert 0.99 * amplitude < reached < 1.01 * amplitude
    assert_allclose(moved, expected, rtol=2e-3)
    assert_allclose(bending(REVERSED, amplitude)[0], -expected, rtol=2e-3)
    assert np.abs(bending(PLAIN, amplitude)[0]).max() < 1e-3 * expected


def test_a_bending_robot_crawls_in_space_too():
    moved, _ = bending(SCALES, 0.4, "spatial")
    back, _ = bending(REVERSED, 0.4, "spatial")
    assert moved.min() > 5e-3
    assert_allclose(back, -moved, rtol=1e-2)


def test_the_serpenoid_moves_on_flat_ground_with_scales():
    def distance(scene):
        run = snake_env.simulate(
            scene=scene, gait=Gait.lateral_undulation(), start=Start(position=(0.0, 0.0)), duration=8.0
        )
        return np.linalg.norm(run.position[-1].mean(axis=0) - run.position[0].mean(axis=0))

    assert distance(SCALES) > 0.8 > 8 * distance(Scene(friction=(0.2, 0.2)))


def two_links(time, z, smoothing):
    """Derivative of (x, y, theta, phi) and their rates for two links, the friction of each as a smooth function."""
    mass, inertia, half, gravity = 7.5 / 11, 1.32e-3, LENGTH / 2, 9.81
    forward, backward, across = 0.1, 0.3, 0.4
    theta, phi, q = z[2], z[3], z[4:]
    angles, rates = (theta, theta + phi), (q[2], q[2] + q[3])
    along = [np.array([np.cos(a), np.sin(a)]) for a in angles]
    normal = [np.array([-np.sin(a), np.cos(a)]) for a in angles]
    first, second, change = np.eye(2, 4), np.eye(2, 4), np.zeros((2, 4))
    second[:, 2], second[:, 3] = half * (normal[0] + normal[1]), half * normal[1]
    change[:, 2], change[:, 3] = -half * (rates[0] * along[0] + rates[1] * along[1]), -half * rates[1] * along[1]
    turns = np.array([[0, 0, 1, 0], [0, 0, 1, 1]])
    matrix = mass * (first.T @ first + second.T @ second) + inertia * turns.T @ turns
    force = -mass * second.T @ (change @ q)
    for jacobian, e, n in zip((first, second), along, normal, strict=True):
        slip = jacobian @ q
        mu = np.array([forward if slip @ e < 0 else backward, across])
        v = np.array([slip @ e, slip @ n])
        pull = -mass * gravity * mu**2 * v / np.sqrt(((mu * v) ** 2).sum() + (0.3 * smoothing) ** 2)
        force += jacobian.T @ (pull[0] * e + pull[1] * n)
    force[3] += 8.0 * (0.8 * np.sin(3 * time) - phi) + 0.2 * (2.4 * np.cos(3 * time) - q[3])
    return np.concatenate([q, np.linalg.solve(matrix, force)])


def test_two_links_move_as_in_an_independent_simulation():
    def smooth(smoothing):
        options = {"method": "LSODA", "rtol": 1e-8, "atol": 1e-10, "max_step": 5e-3, "args": (smoothing,)}
        return solve_ivp(two_links, (0.0, 3.0), np.zeros(8), **options).y[:4, -1]

    def ours(scene):
        run = snake_env.simulate(
            robot=Robot(links=2),
            scene=scene,
            gait=Gait(amplitude=0.8, omega=3.0, beta=0.0, gamma=0.0),
            controller=PD(kp=8.0, kd=0.2),
            start=Start(position=(0.0, 0.0), heading=0.0, posture="straight"),
            duration=3.0,
            integrator=Integrator(step=5e-4),
        )
        return np.array([*run.position[-1, 0], run.angle[-1, 0], run.joint_angle[-1, 0]])

    scales = Scene(friction=(0.1, 0.4), friction_backward=0.3)
    # The error of the smooth law is proportional to its parameter.
    rough, fine = smooth(1e-3), smooth(1e-4)
    assert_allclose(ours(scales), fine + (fine - rough) / 9, atol=1e-5)
    assert np.abs(ours(dataclasses.replace(scales, friction_backward=None))[0] - fine[0]) > 0.02


def test_both_coefficients_along_a_link_are_scaled_by_randomization():
    def run(friction, backward, factor):
        env = snake_env.SnakeVectorEnv(
            2,
            task="free",
            friction=friction,
            friction_backward=backward,
            randomization=Randomization(friction=(factor, factor)),
        )
        env.reset(seed=3)
        for k in range(20):
            env.step(np.full(env.action_space.shape, np.sin(k), np.float32))
        return env.state().link_position

    assert_allclose(run((0.2, 0.4), 0.6, 0.5), run((0.1, 0.2), 0.3, 1.0), atol=1e-9)
    assert np.abs(run((0.2, 0.4), 0.6, 0.5) - run((0.2, 0.4), 0.6, 1.0)).max() > 1e-3


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_an_environment_has_the_skin_of_its_keyword_or_scene(model):
    by_keyword = snake_env.SnakeVectorEnv(2, task="free", model=model, friction=(0.1, 0.6), friction_backward=0.3)
    by_scene = snake_env.SnakeVectorEnv(2, task="free", model=model, scene=SCALES)
    positions = []
    for env in (by_keyword, by_scene):
        env.reset(seed=1)
        assert (env.scene(1).friction, env.scene(1).friction_backward) == ((0.1, 0.6), 0.3)
        for _ in range(5):
            env.step(np.full(env.action_space.shape, 0.3, np.float32))
        positions.append(env.state().link_position)
    assert_array_equal(*positions)
    with pytest.raises(ConfigError, match=r"friction_backward = 0\.3: expected None beside a scene"):
        snake_env.SnakeVectorEnv(2, model=model, scene=SCALES, friction_backward=0.3)
    with pytest.raises(ConfigError, match="friction_backward"):
        snake_env.SnakeVectorEnv(2, model=model, friction_backward=-0.3)


def test_a_scene_keeps_its_skin(tmp_path):
    SCALES.save(tmp_path / "scales.json")
    for again in (Scene.load(tmp_path / "scales.json"), copy.deepcopy(SCALES), pickle.loads(pickle.dumps(SCALES))):
        assert again == SCALES
        assert again.friction_backward == 0.3
    assert "friction_backward=0.3" in repr(SCALES)
    assert Scene().friction_backward is None


def test_what_has_no_skin_refuses_it(simple_ground):
    with pytest.raises(ConfigError, match=r"scene\.friction_backward = 0\.3: expected None"):
        snake_env.simulate(scene=SCALES, duration=0.01, sample=0.01, **simple_ground)
    equal = dataclasses.replace(SCALES, friction_backward=0.1)
    snake_env.simulate(scene=equal, duration=0.01, sample=0.01, **simple_ground)


def test_mujoco_and_environments_with_a_symmetric_model_refuse_it():
    with pytest.raises(ConfigError, match=r"scene\.friction_backward = 0\.3: expected None for MuJoCo"):
        SCALES.to_mjcf()
    dataclasses.replace(SCALES, friction_backward=0.1).to_mjcf()
    with pytest.raises(ConfigError, match="friction_backward"):
        snake_env.SnakeVectorEnv(2, friction_backward=0.3, controller=IOLinearizing())
