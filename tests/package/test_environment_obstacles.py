"""Walls and rough obstacles in environments: what they do, how they are seen, kept and drawn."""

from __future__ import annotations

import numpy as np
import pytest

from snake_env import ConfigError, Scene, SnakeVectorEnv
from snake_env.obstacles import Box, Circle, Polygon, Segment, circles, outlines
from snake_env.palette import PEG

FRICTION = (0.2, 0.5)
WALLS = (
    Segment((1.0, -0.6), (1.1, 0.7)),
    Box((0.4, 0.1), 0.2, -0.8, angle=0.4),
    Polygon(((-1.3, 0.5), (-0.7, 0.6), (-1.0, 0.9))),
    Circle(0.08, 0.4, 0.9, friction=0.5),
)


def scene(*obstacles):
    return Scene(obstacles=obstacles, friction=FRICTION)


def run(env, steps):
    """Random actions, held for five periods."""
    rng = np.random.default_rng(0)
    for step in range(steps):
        if step % 5 == 0:
            action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        env.step(action)


def nearest(obstacles, place):
    """Nearest points of obstacles, nearest first: pegs by their centres, walls by sampled outlines."""
    found = []
    for radius, *centre in circles(obstacles):
        found.append((np.linalg.norm(np.subtract(centre, place)) - radius, np.array(centre)))
    for corners in outlines(obstacles):
        share = np.linspace(0, 1, 4001)[:, None]
        sides = [
            start + share * (end - start) for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)
        ]
        points = np.concatenate(sides)
        away = np.linalg.norm(points - place, axis=1)
        found.append((away.min(), points[away.argmin()]))
    return sorted(found, key=lambda one: one[0])


def test_a_wall_stops_a_robot_that_gets_ahead_without_it():
    ends = []
    for obstacles in ((), (Segment((0.6, -3.0), (0.6, 3.0)),), (Box((0.2, 6.0), 0.7, 0.0),)):
        env = SnakeVectorEnv(1, task="free", scene=scene(*obstacles), start_jitter=0.0)
        env.reset(seed=0)
        for _ in range(60):
            env.step(np.zeros(env.action_space.shape, np.float32))
        state = env.state()
        ends.append(float((state.link_position[0, :, 0] + 0.04 * np.abs(np.cos(state.link_angle[0]))).max()))
    assert ends[0] > 0.75
    assert max(ends[1:]) < 0.6 - 0.0525 + 1e-3


def test_walls_are_seen_at_their_nearest_points():
    env = SnakeVectorEnv(3, task="field", scene=scene(*WALLS), observation="dict", nearest_pegs=4)
    env.reset(seed=1)
    run(env, 20)
    observation, *_ = env.step(np.zeros(env.action_space.shape, np.float32))
    state, reach = env.state(), 11 * 0.122
    for i in range(3):
        seen = np.reshape(observation["pegs"][i], (4, 3)) * reach
        place, angle = state.link_position[i, 0], state.link_angle[i, 0]
        expected = [one for one in nearest(WALLS, place) if one[0] < reach]
        assert len(expected) >= 2
        assert not seen[len(expected) :].any()
        forward = -np.array([np.cos(angle), np.sin(angle)])
        left = np.array([-forward[1], forward[0]])
        for (distance, point), located in zip(expected, seen, strict=False):
            offset = point - place
            np.testing.assert_allclose(located, [offset @ forward, offset @ left, reach - distance], atol=2e-3)


def test_friction_at_an_obstacle_acts_along_it():
    """A robot that runs into a wall across its way: forces along the wall only where it is rough, within mu of those
    across it. Means over a control period keep the bound."""
    for mu in (0.0, 0.5):
        env = SnakeVectorEnv(
            1,
            task="free",
            scene=scene(Segment((0.6, -3.0), (0.6, 3.0), friction=mu)),
            start_jitter=0.0,
            integrator={"tolerance": 1e-7},
        )
        env.reset(seed=0)
        forces = []
        for _ in range(60):
            env.step(np.zeros(env.action_space.shape, np.float32))
            forces.append(env.state().contact_force[0].copy())
        across, along = np.abs(np.moveaxis(forces, -1, 0))
        assert across.max() > 1.0
        assert (along <= mu * across + 1e-3).all()
        assert (along.max() > 0.5) == (mu > 0.0)


def test_the_scene_of_a_robot_is_that_of_the_user():
    env = SnakeVectorEnv(2, task="field", scene=scene(*WALLS))
    env.reset(seed=0)
    assert tuple(env.scene(1).obstacles) == WALLS
    env.reset(options={"scene": scene((0.1, 3.0, 0.0))})
    assert tuple(env.scene(1).obstacles) == ((0.1, 3.0, 0.0),)


def test_a_drawn_scene_follows_a_prescribed_one_without_its_walls():
    env = SnakeVectorEnv(1, task="field")
    env.reset(seed=0)
    drawn = env.scene(0)
    env.reset(seed=0, options={"scene": Scene(obstacles=WALLS, friction=(0.2, 0.2))})
    assert tuple(env.scene(0).obstacles) == WALLS
    env.reset(seed=0)
    assert env.scene(0) == drawn


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"scene": scene(Segment((0.0, -1.0), (0.0, 1.0)))}, r"scene\.obstacles\[0\]"),
        ({"scene": scene((0.1, 3.0, 3.0), Box((0.5, 0.5), -0.3, 0.0))}, r"scene\.obstacles\[1\]"),
        ({"scene": scene(Circle(0.1, 3.0, 3.0, height=0.2))}, r"scene\.obstacles\[0\]\.height"),
    ],
)
def test_what_does_not_fit_is_named(options, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        SnakeVectorEnv(1, task="free", **options).reset(seed=0)


def test_walls_are_drawn():
    pytest.importorskip("pygame")
    pictures = []
    for obstacles in ((), (Segment((0.6, -3.0), (0.6, 3.0)),), (Box((0.2, 6.0), 0.7, 0.0),)):
        env = SnakeVectorEnv(1, task="free", scene=scene(*obstacles), start_jitter=0.0, render_mode="rgb_array")
        env.reset(seed=0)
        pictures.append(env.render()[0])
    plain, line, box = ((picture == PEG).all(axis=-1).sum() for picture in pictures)
    assert plain == 0 < line < box
