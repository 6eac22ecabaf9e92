"""Inclined ground: robots stand below the angle of friction and slide beyond it, in all three models."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snake_env
from snake_env import Gait, Integrator, Robot, Scene, Start

GRAVITY = Robot().gravity
STILL = Gait(amplitude=0.0)
ALONG_X = Start(posture="straight", heading=0.0)
HOUR = 3600.0
MODELS = ["planar", "spatial", "minimal"]


def ground(angle: float, direction: float = 0.0, **changes) -> Scene:
    return Scene(**({"friction": (0.3, 0.3), "rolling_friction": 0.3, "slope": (angle, direction)} | changes))


def shift(run: snake_env.Trajectory) -> np.ndarray:
    """How far each link moves in the ground plane during a run (n, 2) [m]."""
    return run.position[-1, :, :2] - run.position[0, :, :2]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("method", ["implicit", "thesis"])
def test_a_robot_that_slides_downhill_accelerates_by_gravity_less_friction(model, method):
    angle, mu, time = 0.4, 0.3, 0.5
    run = snake_env.simulate(
        model, scene=ground(angle), gait=STILL, start=ALONG_X, duration=time, integrator=Integrator(method=method)
    )
    downhill = GRAVITY * (math.sin(angle) - mu * math.cos(angle))
    tolerance = {"implicit": 1e-3, "thesis": 5e-3}[method]
    assert shift(run)[:, 0] == pytest.approx(-0.5 * downhill * time**2, rel=tolerance)
    assert abs(shift(run)[:, 1]).max() < 1e-6


@pytest.mark.parametrize("model", MODELS)
def test_the_robot_slides_opposite_to_the_direction_in_which_the_ground_rises(model):
    angle, direction = 0.5, 2.1
    start = Start(posture="straight", heading=direction)
    run = snake_env.simulate(model, scene=ground(angle, direction), gait=STILL, start=start, duration=0.3)
    downhill = -np.array([math.cos(direction), math.sin(direction)])
    distance = 0.5 * GRAVITY * (math.sin(angle) - 0.3 * math.cos(angle)) * 0.3**2
    np.testing.assert_allclose(shift(run), np.tile(distance * downhill, (11, 1)), atol=2e-3 * distance)


@pytest.mark.parametrize("model", MODELS)
def test_below_the_angle_of_friction_a_robot_stands_for_an_hour_without_creeping_a_nanometre(model):
    scene = ground(0.9 * math.atan(0.3), 0.7)
    run = snake_env.simulate(model, scene=scene, gait=STILL, start=ALONG_X, duration=HOUR, sample=HOUR / 4)
    # Sags of the drives and of the ground's contacts happen in the first seconds.
    crept = np.linalg.norm(run.position[-1] - run.position[1], axis=-1).max()
    assert crept < 1e-9
    assert np.linalg.norm(shift(run), axis=-1).max() < 1e-3


def test_with_arctan_friction_a_robot_creeps_at_the_speed_that_balances_its_weight():
    angle, mu, smoothing = 0.5 * math.atan(0.3), 0.3, 1e-3
    scene = ground(angle, friction_law="arctan", smoothing=smoothing)
    run = snake_env.simulate("minimal", scene=scene, gait=STILL, start=ALONG_X, duration=600.0, sample=100.0)
    speed = smoothing * math.tan(0.5 * math.pi * math.tan(angle) / mu)
    crept = run.position[1, :, 0] - run.position[-1, :, 0]
    assert crept == pytest.approx(speed * 500.0, rel=1e-4)


@pytest.mark.parametrize("model", MODELS)
def test_energy_stays_on_inclined_ground_without_friction(model):
    scene = ground(0.3, 1.0, friction=(0.0, 0.0), rolling_friction=0.0)
    run = snake_env.simulate(model, scene=scene, gait=STILL, start=ALONG_X, duration=1.0)
    kinetic = 0.5 * 7.5 * (GRAVITY * math.sin(0.3)) ** 2
    assert abs(run.energy - run.energy[0]).max() < 1e-3 * kinetic


def energy_of(state, robot: Robot, angle: float) -> np.ndarray:
    """Kinetic and potential energy of robots in motion, from what is known of their links; x rises by ``angle``."""
    omega = state.link_angular_velocity
    turning = robot.inertia * omega**2
    if omega.ndim == 3:
        along = (omega * state.link_axis).sum(axis=2)
        turning = robot.inertia * (omega**2).sum(axis=2) + (robot.roll_inertia - robot.inertia) * along**2
    gravity = -GRAVITY * np.array([math.sin(angle), 0.0, math.cos(angle)])[: state.link_position.shape[2]]
    potential = -robot.mass * state.link_position @ gravity
    return (0.5 * (robot.mass * (state.link_velocity**2).sum(axis=2) + turning) + potential).sum(axis=1)


@pytest.mark.parametrize("angle", [0.0, 0.4])
@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_energy_is_kinetic_and_potential_in_environments_and_runs(model, angle):
    keywords = {"model": model, "action_mode": "joints"}
    envs = snake_env.SnakeVectorEnv(3, task="free", slope=(angle, 0.0), friction=(0.2, 0.2), **keywords)
    envs.reset(seed=1)
    envs.action_space.seed(2)
    for _ in range(5):
        envs.step(envs.action_space.sample())
        np.testing.assert_allclose(envs.state().energy, energy_of(envs.state(), Robot(), angle), rtol=1e-9)
    start = Start(position=(1.0, 0.5), posture="straight", heading=1.0)
    run = snake_env.simulate(model, scene=ground(angle), gait=STILL, start=start, duration=0.1)
    single = snake_env.SnakeEnv(task="free", slope=(angle, 0.0), start=start, **keywords)
    single.reset(seed=0)
    assert run.energy[0] == pytest.approx(single.state().energy, rel=1e-12)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_an_environment_lies_on_the_slope_it_is_given(model):
    def end(slope: float) -> np.ndarray:
        envs = snake_env.SnakeVectorEnv(
            1, task="free", model=model, slope=(slope, 0.0), friction=(0.2, 0.2), start_jitter=0.0
        )
        envs.reset(seed=1)
        start = envs.state().link_position[0, :, :2].mean(axis=0)
        for _ in range(10):
            envs.step(np.zeros(envs.action_space.shape, np.float32))
        return envs.state().link_position[0, :, :2].mean(axis=0) - start

    slid = end(0.6) - end(0.0)
    assert slid[0] < -0.3
    assert abs(slid[1]) < 0.1


def test_a_slope_that_is_not_admissible_is_refused():
    with pytest.raises(snake_env.ConfigError, match=r"slope\[0\] = 2\.?0?: expected a number in \[0, 1\.57"):
        snake_env.SnakeVectorEnv(2, task="free", slope=(2.0, 0.0))
