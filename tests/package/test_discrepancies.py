"""Backlash of the joints and the Stribeck effect, as seen from Python."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Gait, Integrator, Randomization, Robot, Scene, SnakeEnv, SnakeVectorEnv, Stribeck

PLAY = math.radians(4)


def test_joints_with_play_stay_behind_their_references():
    """|phi - phi_d| is half the play beyond what a tight joint needs, and hardly more."""
    scene = Scene.preset("table-7.5")
    late = []
    for play in (0.0, PLAY):
        run = snake_env.simulate(robot=Robot(backlash=play), scene=scene, duration=3.0)
        late.append(np.abs(run.joint_angle - Gait().reference(run.time)["angle"]).max())
        assert run.unconverged.sum() == 0
    assert late[0] < 0.01
    assert 0.5 * PLAY < late[1] < 0.5 * PLAY + 0.02


def test_play_slows_a_robot_on_open_ground_and_not_among_pegs():
    """Mean speed of the CG over a period of the gait; with any play pegs guide the robot alike.

    The tolerance is less than half of what three degrees change on open ground.
    """
    speeds = []
    for scene in (Scene.preset("table-7.5"), Scene.preset("free", friction=(0.2, 0.5))):
        for play in (0, 3, 5):
            robot = Robot(backlash=math.radians(play))
            way = snake_env.simulate(robot=robot, scene=scene, duration=6.5, sample=0.5).position[..., 0].mean(axis=1)
            speeds.append((way[-1] - way[4]) / 4.5)
    np.testing.assert_allclose(speeds[:3], 0.1628, rtol=0.005)
    np.testing.assert_allclose(speeds[3:], [0.0766, 0.0756, 0.0742], rtol=0.005)


def test_what_is_absent_changes_nothing():
    """Bit for bit, whatever the speed of an effect without drop."""
    keywords = {"scene": Scene.preset("table-7.3"), "duration": 1.0}
    plain = snake_env.simulate(**keywords)
    scene = Scene(obstacles=keywords["scene"].obstacles, stribeck=Stribeck(0.0, 0.5), course="table-7.3")
    for run in (
        snake_env.simulate(robot=Robot(backlash=0.0), **keywords),
        snake_env.simulate(**(keywords | {"scene": scene})),
    ):
        for name in ("position", "joint_torque", "contact_force", "residual"):
            np.testing.assert_array_equal(getattr(run, name), getattr(plain, name))


def test_friction_that_falls_lets_a_robot_slide_farther():
    """The printed scheme has the effect too."""
    for method in ("implicit", "thesis"):
        ends = []
        for drop in (0.0, 0.5):
            scene = Scene(friction=(0.2, 0.5), stribeck=Stribeck(drop, 0.05))
            run = snake_env.simulate(scene=scene, integrator=Integrator(method=method), duration=1.0)
            ends.append(run.position[-1])
        assert np.abs(ends[1] - ends[0]).max() > 1e-3, method


def rollout(env: SnakeVectorEnv, seed: int, steps: int = 30) -> np.ndarray:
    """Observations of a seeded episode under one fixed script of actions."""
    observations = [env.reset(seed=seed)[0]]
    actions = np.random.default_rng(5).uniform(-1, 1, (steps, *env.action_space.shape)).astype(np.float32)
    observations += [env.step(action)[0] for action in actions]
    return np.array(observations)


RANDOM = Randomization(backlash=(0.0, math.radians(5)), stribeck=(0.0, 0.4))


def test_draws_are_seeded_and_differ_from_robot_to_robot():
    options = {"task": "course", "start_jitter": 0.0, "randomization": RANDOM}
    first, again = (rollout(SnakeVectorEnv(6, num_threads=threads, **options), 3) for threads in (1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, rollout(SnakeVectorEnv(6, **options), 11))
    same_actions = SnakeVectorEnv(6, **options)
    same_actions.reset(seed=3)
    for _ in range(40):
        last = same_actions.step(np.ones((6, same_actions.action_space.shape[1]), np.float32))[0]
    assert len(np.unique(last, axis=0)) == 6, "each robot has its own play and ground"


def test_a_robot_of_a_batch_is_the_single_one_bit_for_bit():
    options = {"task": "field", "randomization": RANDOM}
    batch, single = SnakeVectorEnv(5, **options), SnakeEnv(**options)
    batch.reset(seed=20)
    single.reset(seed=23)
    for action in np.random.default_rng(1).uniform(-1, 1, (25, *batch.action_space.shape)).astype(np.float32):
        many, one = batch.step(action)[0], single.step(action[3])[0]
        np.testing.assert_array_equal(many[3], one)


def test_the_spaces_stay_as_they_are():
    plain = SnakeVectorEnv(2, task="field")
    loose = SnakeVectorEnv(2, task="field", randomization=RANDOM, stribeck=Stribeck(0.2), robot=Robot(backlash=PLAY))
    assert loose.observation_space == plain.observation_space
    assert loose.action_space == plain.action_space
    assert list(loose.reset()[1]) == list(plain.reset()[1])


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"stribeck": {"drop": 1.2}}, "stribeck.drop"),
        ({"stribeck": {"speed": 0.0}}, "stribeck.speed"),
        ({"stribeck": {"drop": 0.8}, "randomization": Randomization(stribeck=(0.0, 0.4))}, "randomization.stribeck"),
        ({"robot": {"backlash": -0.1}}, "robot.backlash"),
        ({"robot": {"backlash": 0.1}, "controller": "io"}, "robot.backlash"),
        ({"randomization": RANDOM, "controller": "io"}, "randomization.backlash"),
    ],
)
def test_what_a_robot_cannot_have_is_named(options, field):
    with pytest.raises(ConfigError) as caught:
        SnakeEnv(task="course", **options)
    assert caught.value.field == field, caught.value
