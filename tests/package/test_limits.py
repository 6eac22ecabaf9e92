"""What is too large, too small, too long or too much is refused before it hangs, overflows or does not fit."""

from __future__ import annotations

import contextlib
import itertools
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import snake_env
from snake_env import PD, Batch, ConfigError, Integrator, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start
from snake_env.obstacles import Box, Circle, Polygon, Segment

SOON = 5.0
"""CPU time within which an environment of any admissible robot is made and reset [s]."""


@pytest.mark.parametrize("kind", ["mixed", "track", "lattice", "poisson"])
@pytest.mark.parametrize(
    "robot",
    [Robot(radius=0.003), Robot(links=300), Robot(length=4.0), Robot(links=150, radius=0.03, length=0.2)],
    ids=["thin", "many links", "long links", "long"],
)
def test_a_field_for_any_robot_is_made_soon(robot, kind):
    begin = time.process_time()
    env = SnakeEnv(task="field", field=kind, robot=robot)
    env.reset(seed=0)
    assert time.process_time() - begin < SOON
    assert len(env.scene().obstacles) > 10


@pytest.mark.parametrize("task", ["field", "corridor"])
@pytest.mark.parametrize(
    "robot",
    [Robot(radius=1e-6, length=3e-6, contact_half_length=1e-7), Robot(links=10_000, length=1e-6, self_contact=False)],
    ids=["tiny", "short links"],
)
def test_a_field_of_too_many_pegs_is_refused_with_what_makes_it_large(task, robot):
    with pytest.raises(ConfigError) as caught:
        SnakeEnv(task=task, robot=robot, goal_distance=15.0, push_points=1 if task == "field" else 0)
    for name in ("robot.radius", f"{robot.links} links", "goal_distance = 15", "corridor_half_width = 0.8"):
        assert name in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_the_search_for_push_points_ends_soon():
    begin = time.process_time()
    env = SnakeEnv(task="field", robot=Robot(radius=0.005, length=0.02, contact_half_length=0.005), push_points=4)
    env.reset(seed=0)
    assert time.process_time() - begin < SOON


@pytest.mark.parametrize("method", ["implicit", "thesis"])
@pytest.mark.parametrize("step", [1e-12, 1e-9, 1e4, 1e300])
def test_steps_of_no_use_are_refused(method, step):
    with pytest.raises(ConfigError, match=r"^integrator\.step = .*: expected a number in"):
        Integrator(method=method, step=step)


def test_a_call_has_a_bounded_number_of_steps():
    with pytest.raises(ConfigError, match=r"^control_period = 0\.5: .*at most 100000 steps of .*2e-6 s"):
        SnakeEnv(control_period=0.5, integrator=Integrator(step=2e-6))
    with pytest.raises(ConfigError, match=r"^duration = 1000: .*at most 1000000000 steps of .*1e-7 s"):
        snake_env.simulate(duration=1e3, sample=1e3, integrator=Integrator(step=1e-7))
    for name, held in (("treatment", 1e-12), ("treatment", 1e9)):
        with pytest.raises(ConfigError, match=rf"controller\.{name} = "):
            snake_env.simulate("minimal", controller=snake_env.IOLinearizing(treatment=held), duration=0.1)
    with pytest.raises(ConfigError, match=r"integrator\.max_iterations = 4000000000"):
        Integrator(max_iterations=4_000_000_000)


@contextlib.contextmanager
def alarm(seconds):
    """Raises TimeoutError after a while."""

    def ring(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_signal_ends_a_step_soon_and_the_robots_begin_anew(model, num_threads):
    envs = SnakeVectorEnv(
        num_envs=100,
        model=model,
        task="free",
        integrator=Integrator(step=1e-5),
        control_period=0.5,
        num_threads=num_threads,
    )
    first, _ = envs.reset(seed=3)
    action = np.zeros(envs.action_space.shape, np.float32)
    begin = time.monotonic()
    with alarm(0.2), pytest.raises(TimeoutError):
        envs.step(action)
    assert time.monotonic() - begin < 10.0, "50 ms on an idle machine; the step takes minutes"
    with pytest.raises(ResetNeeded):
        envs.step(action)
    np.testing.assert_array_equal(envs.reset(seed=3)[0], first)


def test_a_signal_ends_a_step_of_a_batch():
    batch = Batch(100, integrator=Integrator(step=1e-5), control_period=0.5, num_threads=2)
    start = batch.state["link_position"].copy()
    with alarm(0.2), pytest.raises(TimeoutError):
        batch.step()
    for call in (batch.step, lambda: batch.reset(np.arange(100) < 50)):
        with pytest.raises(ResetNeeded):
            call()
    batch.reset(seed=0)
    np.testing.assert_array_equal(batch.state["link_position"], start)
    several = Batch(2, control_period=0.001)
    with alarm(0.2), pytest.raises(TimeoutError):
        several.step(10**7)
    assert several.state["time"].max() > 0.001


def test_robots_of_ten_thousand_links_fit_into_memory():
    """Memory grows with the number of links, not with its square."""
    code = """if True:
        import gymnasium, snake_env
        for task in ("SnakeFree-v1", "SnakeSpatial-v1"):
            gymnasium.make(task, robot=snake_env.Robot(links=10_000)).close()
        snake_env.simulate(robot=snake_env.Robot(links=10_000), duration=0.01, sample=0.01)"""
    limit = 4 << 30
    command = [sys.executable, "-c", code]
    subprocess.run(command, check=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))


def test_what_does_not_fit_into_memory_is_refused_with_what_it_needs():
    with pytest.raises(ConfigError, match=r"num_envs = 1000000: .*robots of 10000 links need about 16250\.000 GB"):
        SnakeVectorEnv(num_envs=1_000_000, task="free", robot=Robot(links=10_000))
    many = Scene(obstacles=[(0.01, 3.0 + 0.1 * k, 0.0) for k in range(3000)])
    with pytest.raises(ConfigError, match=r"num_envs = 1000000: .*GB"):
        SnakeVectorEnv(num_envs=1_000_000, scene=many)
    with pytest.raises(ConfigError, match=r"duration = 100000: .*10000000 samples every 0\.01 s need about .* GB"):
        snake_env.simulate(robot=Robot(links=1000), duration=1e5, sample=0.01)


@pytest.mark.parametrize("model", ["planar", "spatial"])
@pytest.mark.parametrize(("links", "num_envs"), [(11, 2000), (500, 30), (500, 13)])
def test_the_memory_that_is_refused_is_about_what_environments_take(model, links, num_envs):
    code = f"""if True:
        import snake_env
        used = lambda: 4096 * int(open("/proc/self/statm").read().split()[1])
        make = lambda n, links: snake_env.SnakeVectorEnv(
            num_envs=n, model={model!r}, task="free", num_threads=1, robot=snake_env.Robot(links=links))
        make(1, 2).reset()
        before = used()
        envs = make({num_envs}, {links})
        envs.reset()
        envs.step(0.0 * envs.action_space.sample())
        print((used() - before) / ({num_envs} * {links}))"""
    per_link = float(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout)
    workspaces = -(-num_envs // 64)
    expected = {"planar": 1000, "spatial": 2000}[model] + 40_000 * workspaces / num_envs
    assert expected / 3 < per_link < expected * 1.2, f"{per_link:.0f} bytes"


HUGE = [1e7, 1e300, -1e300]


@pytest.mark.parametrize("huge", HUGE)
def test_places_beyond_which_differences_are_lost_are_refused(huge):
    """Numbers in f32 observations overflow at 3e38, squares of f64 at 1e154."""
    worlds = [
        {"start": Start(position=(huge, 0.0))},
        {"start": Start(position=(0.0, huge))},
        {"start": Start(heading=huge)},
        {"goal": (huge, 0.0)},
        {"goal": (3.0, 0.0, abs(huge))},
        {"goal": abs(huge)},
        {"goal": [(0.0, 0.0), (2.0, huge)]},
        {"goal": {"heading": huge}} | {"task": "command"},
    ]
    for world in worlds:
        with pytest.raises(ConfigError, match="expected a number in"):
            SnakeEnv(**world).reset(seed=0)
    size = abs(huge)
    for make in (
        lambda: Circle(0.1, huge, 0.0),
        lambda: Circle(size, 0.0, 0.0),
        lambda: Box((size, 1.0), 0.0, 0.0),
        lambda: Box((1.0, 1.0), 0.0, 0.0, angle=huge),
        lambda: Segment((0.0, 0.0), (0.0, huge)),
        lambda: Polygon([(0.0, 0.0), (1.0, 0.0), (0.0, huge)]),
        lambda: Robot(length=size),
        lambda: Robot(radius=size),
        lambda: snake_env.Gait(amplitude=huge),
    ):
        with pytest.raises(ConfigError, match="expected a number in"):
            make()


def is_contained(model, seed=0, **options):
    """Observations are finite, or the robot is flagged; solves that fail are given up soon."""
    envs = SnakeVectorEnv(num_envs=2, model=model, integrator=Integrator(max_iterations=20), **options)
    observation, _ = envs.reset(seed=seed)
    assert np.isfinite(observation).all()
    for k in range(2):
        action = np.full(envs.action_space.shape, (-1.0) ** k, np.float32)
        observation, reward, *_, info = envs.step(action)
        assert (np.isfinite(observation).all(axis=1) | info["diverged"]).all(), observation
        assert (np.isfinite(reward) | info["diverged"]).all()
    return True


@pytest.mark.parametrize("model", ["planar", "spatial"])
@pytest.mark.parametrize("far", [-1e6, 1e6])
def test_results_are_finite_as_far_as_places_are_admissible(model, far):
    worlds = {"start": Start(position=(far, -far)), "goal": (-far, far), "scene": Scene(obstacles=[(0.1, far, far)])}
    assert is_contained(model, **worlds)


EXTREMES = {
    "mass": [1e-15, 1e12],
    "inertia": [1e-15, 1e12],
    "roll_inertia": [1e-15, 1e12],
    "gravity": [1e-15, 1e12],
    "length": [1e-9, 1e6],
    "radius": [1e-9, 1e6],
    "contact_half_length": [0.0, 1e6],
    "cg_offset": [-0.061 + 1e-12, 0.061 - 1e-12],
}


@pytest.mark.parametrize("model", ["planar", "spatial"])
@pytest.mark.parametrize(("name", "value"), [(name, v) for name, values in EXTREMES.items() for v in values])
def test_robots_at_the_ends_of_the_ranges_are_contained(model, name, value):
    robot = Robot(**{"self_contact": False, name: value})
    assert is_contained(model, task="free", robot=robot)


@pytest.mark.parametrize("model", ["planar", "spatial"])
@pytest.mark.parametrize(("kp", "kd", "limit"), list(itertools.product([0.0, 1e12], [0.0, 1e12], [None, 1e-15, 1e12])))
def test_gains_at_the_ends_of_their_ranges_are_contained(model, kp, kd, limit):
    assert is_contained(model, task="free", controller=PD(kp, kd, torque_limit=limit))


@pytest.mark.parametrize(("method", "unit"), [("implicit", "m/s"), ("thesis", "N s")])
def test_a_tolerance_at_which_sliding_and_sticking_are_the_same_is_refused(method, unit):
    Integrator(method=method, tolerance=0.01)
    for value in (0.011, 1.0, 1e300):
        with pytest.raises(ConfigError, match=r"^integrator\.tolerance = .*expected a number in"):
            Integrator(method=method, tolerance=value)
