"""Spheres that can be pushed: simulate, files, pictures, environments and MuJoCo."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from conftest import advance, check_arrays, check_continues, in_mujoco

import snake_env
from snake_env import ConfigError, Integrator, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start, load_trajectory
from snake_env.obstacles import Box, HeightField, Polyhedron, Sphere, is_movable

BALL = Sphere(0.06, -0.2, 0.02, 0.3, rolling_friction=0.01)
"""Before the head of a robot that moves towards -x."""
DROPPED = Sphere(0.05, 0.0, 2.0, 0.2, z=0.55, ground_friction=0.4)
CRATE = Box((0.15, 0.1), -0.2, 3.0, 0.3, mass=0.4)
YARD = Scene(obstacles=[(0.1, 0.4, 0.6), BALL, CRATE, DROPPED], friction=(0.1, 0.6))
AHEAD = Start(position=(0.0, 0.0), heading=0.0, posture="gait")
IN_3D = {"model": "spatial", "start": AHEAD, "start_jitter": 0.0}


def test_a_trajectory_has_the_heights_of_balls_that_fall_and_are_pushed(tmp_path):
    run = snake_env.simulate("spatial", scene=YARD, start=AHEAD, duration=2.0, sample=0.1, record=["velocity"])
    check_arrays(run, obstacle_position=(3, 2), obstacle_angle=(3,), obstacle_height=(3,), obstacle_velocity=(3, 2))
    np.testing.assert_array_equal(run.obstacle_height[0], [BALL.radius, 0.0, DROPPED.z])
    assert run.obstacle_height[3, 2] == pytest.approx(DROPPED.z - 0.5 * 9.81 * 0.3**2, abs=1e-3)
    np.testing.assert_allclose(run.obstacle_height[-1], [BALL.radius, 0.0, DROPPED.radius], atol=1e-4)
    assert np.linalg.norm(run.obstacle_position[-1, 0] - [BALL.x, BALL.y]) > 0.03
    assert not run.unconverged.any()
    for ending in ("npz", "csv"):
        again = load_trajectory(run.save(tmp_path / f"run.{ending}"))
        np.testing.assert_array_equal(again.obstacle_height, run.obstacle_height)
        assert again.scene == YARD
    upright = Scene(obstacles=[CRATE])
    assert snake_env.simulate("spatial", scene=upright, start=AHEAD, duration=0.1).obstacle_height is None


def test_scenes_with_balls_survive_files_and_know_where_they_are(tmp_path):
    for name in ("yard.json", "yard.yaml"):
        YARD.save(tmp_path / name)
        assert Scene.load(tmp_path / name) == YARD
    assert (BALL.height, DROPPED.height) == (0.06, 0.55)
    places = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    there = YARD.with_obstacles_at(places, np.zeros(3), [0.1, 0.0, 0.2]).obstacles
    assert there[1] == replace(BALL, x=1.0, y=2.0, z=0.1)
    assert there[3] == replace(DROPPED, x=5.0, y=6.0, z=0.2)
    assert YARD.with_obstacles_at(places).obstacles[3].z == DROPPED.z
    for name, wrong in (("position", (places[:2],)), ("angle", (places, [0.0])), ("height", (places, None, [0.1] * 4))):
        with pytest.raises(ConfigError, match=name):
            YARD.with_obstacles_at(*wrong)
    assert YARD.moved(2, 0.5, -0.5).obstacles[1] == replace(BALL, x=BALL.x + 0.5, y=BALL.y - 0.5)


@pytest.mark.parametrize(
    ("make", "field", "words"),
    [
        (lambda: Sphere(0.1, 0.0, 0.0, None), "obstacle.mass", "a value"),
        (lambda: Sphere(0.1, 0.0, 0.0, 0.0), "obstacle.mass", "> 0"),
        (lambda: Sphere(-0.1, 0.0, 0.0, 1.0), "obstacle.radius", "> 0"),
        (lambda: Sphere(0.1, 0.0, 0.0, 1.0, z=np.nan), "obstacle.z", "finite"),
        (lambda: Sphere(0.1, 0.0, 0.0, 1.0, rolling_friction=-0.1), "obstacle.rolling_friction", ">= 0"),
        (lambda: Sphere(0.1, 0.0, 0.0, 1.0, ground_friction=-0.1), "obstacle.ground_friction", ">= 0"),
        (
            lambda: Scene(obstacles=[{"shape": "sphere", "radius": 0.1, "x": 0.0, "y": 0.0}]),
            "scene.obstacles[0]",
            "radius, x, y, mass",
        ),
        (
            lambda: Scene(obstacles=[{"shape": "sphere", "radius": 0.1, "x": 0, "y": 0, "mass": 1, "height": 0.1}]),
            "scene.obstacles[0].height",
            "rolling_friction",
        ),
        (lambda: snake_env.simulate(scene=Scene(obstacles=[BALL])), "scene.obstacles[0]", 'model="spatial"'),
        (lambda: SnakeEnv(scene=Scene(obstacles=[BALL])), "scene.obstacles[0]", 'model="spatial"'),
        (
            lambda: snake_env.simulate("spatial", scene=Scene(obstacles=[BALL]), integrator=Integrator("thesis")),
            "scene.obstacles[0].mass",
            'method="implicit"',
        ),
        (
            lambda: snake_env.simulate("spatial", scene=Scene(obstacles=[replace(BALL, z=0.05)])),
            "scene.obstacles[0]",
            "start outside others",
        ),
        (lambda: SnakeEnv(scene=Scene(obstacles=[replace(BALL, x=0.3)]), **IN_3D), "scene.obstacles[0]", "start free"),
    ],
)
def test_what_a_ball_cannot_be_is_refused_by_name(make, field, words):
    with pytest.raises(ConfigError, match=r"expected") as refused:
        make()
    assert refused.value.field == field
    assert words in str(refused.value)


def test_balls_roll_on_ground_on_which_nothing_upright_can_stand():
    flat = HeightField(np.zeros((3, 3)), spacing=0.5, origin=(1.0, 0.0))
    ramp = Polyhedron([(x, y, z) for y in (1.5, 2.5) for x, z in [(1.0, 0.0), (2.0, 0.0), (2.0, 0.4)]], friction=0.5)
    balls = [Sphere(0.1, 1.4, 0.5, 0.5), Sphere(0.05, 1.8, 2.0, 0.5, z=0.4)]
    scene = Scene(obstacles=[flat, ramp, *balls], slope=(0.3, np.pi))
    run = snake_env.simulate("spatial", scene=scene, start=Start(position=(-1.0, 0.0)), duration=0.4)
    assert run.obstacle_position[-1, 0, 0] > 1.5
    np.testing.assert_allclose(run.obstacle_height[:, 0], 0.1, atol=1e-6)
    assert run.obstacle_height[-1, 1] > 0.3
    with pytest.raises(ConfigError, match="of what can be pushed only spheres meet others"):
        snake_env.simulate("spatial", scene=replace(scene, obstacles=[flat, CRATE]))


def test_environments_have_balls_in_state_observation_pictures_and_saved_states():
    options = {**IN_3D, "observation": "dict", "observation_blocks": ["pegs", "range"]}
    scene = replace(YARD, obstacles=[*YARD.obstacles[:3], replace(DROPPED, z=5.0)])
    with closing(SnakeEnv(scene=scene, render_mode="rgb_array", **options)) as env:
        first, _ = env.reset(seed=0)
        np.testing.assert_array_equal(env.state().obstacle_height, [BALL.radius, 0.0, 5.0])
        picture = env.render()
        for _ in range(18):
            env.step(np.zeros(env.action_space.shape))
        state = env.state()
        assert np.linalg.norm(state.obstacle_position[0] - [BALL.x, BALL.y]) > 0.02
        assert DROPPED.radius < state.obstacle_height[2] < 2.0
        assert (env.render() != picture).any()
        check_continues(env, "obstacle_height")
    # A ball as high as the sensor is seen like a peg of its radius.
    with closing(SnakeEnv(scene=Scene(obstacles=[(BALL.radius, BALL.x, BALL.y)]), **options)) as env:
        peg, _ = env.reset(seed=0)
    level = replace(BALL, z=0.0525, radius=0.0525)
    with closing(SnakeEnv(scene=Scene(obstacles=[level]), **options)) as env:
        ball, _ = env.reset(seed=0)
    with closing(SnakeEnv(scene=Scene(obstacles=[(0.0525, BALL.x, BALL.y)]), **options)) as env:
        same, _ = env.reset(seed=0)
    for name in options["observation_blocks"]:
        np.testing.assert_allclose(ball[name], same[name], atol=1e-6)
    np.testing.assert_allclose(first["pegs"][:3], peg["pegs"][:3], atol=1e-6)


def test_rays_pass_over_balls_that_are_lower_than_the_sensor():
    def seen(*balls):
        with closing(
            SnakeEnv(scene=Scene(obstacles=balls), observation="dict", observation_blocks=["range"], **IN_3D)
        ) as env:
            return env.reset(seed=0)[0]["range"]

    nothing, low = seen(), seen(Sphere(0.02, -0.4, 0.0, 0.1))
    np.testing.assert_array_equal(low, nothing)
    # The section at the height of the ray, 0.0525 m, has the radius of this peg.
    with_ball = seen(Sphere(0.1, -0.4, 0.0, 0.1))
    section = np.sqrt(0.1**2 - (0.1 - 0.0525) ** 2)
    np.testing.assert_allclose(with_ball, seen((section, -0.4, 0.0)), atol=1e-6)
    assert (with_ball < nothing).any()


def test_robots_of_a_batch_have_balls_of_their_own():
    scenes = [replace(YARD, obstacles=chosen) for chosen in ([(0.1, 0.0, 3.0)], [BALL], [CRATE, DROPPED])]
    with closing(SnakeVectorEnv(12, scene=scenes, **IN_3D)) as envs:
        envs.reset(seed=0)
        drawn = [sum(map(is_movable, envs.scene(i).obstacles)) for i in range(12)]
        assert set(drawn) == {0, 1, 2}
        for _ in range(10):
            envs.step(np.zeros(envs.action_space.shape, np.float32))
        together = envs.state()
        saved = envs.get_state()
        envs.step(np.zeros(envs.action_space.shape, np.float32))
        later = envs.state().obstacle_height
        envs.set_state(saved)
        envs.step(np.zeros(envs.action_space.shape, np.float32))
        np.testing.assert_array_equal(envs.state().obstacle_height, later)
    assert np.isfinite(together.obstacle_height).sum(axis=1).tolist() == drawn
    for i, count in enumerate(drawn):
        row = together.robot(i)
        assert row.obstacle_height.shape == (count,)
        if count == 2:
            assert row.obstacle_height[0] == 0.0
            assert row.obstacle_height[1] < DROPPED.z - 0.1


def test_pictures_and_viewer_show_balls_where_they_are():
    pytest.importorskip("pygame")
    viser = pytest.importorskip("viser")
    from snake_env.palette import PEG
    from snake_env.viewer.drawing import Drawing
    from snake_env.viewer.frames import Frames

    picture = {"camera": "fixed", "centre": (BALL.x, BALL.y), "layers": ("obstacles",), "zoom": 4.0}
    with closing(SnakeEnv(scene=YARD, render_mode="rgb_array", picture=picture, **IN_3D)) as env:
        env.reset(seed=0)
        assert (env.render()[480:] == PEG).all(axis=2).any(), "the ball beside the robot, seen from the side"
        states = [env.state()]
        for _ in range(20):
            env.step(np.zeros(env.action_space.shape))
        states.append(env.state())
        seen_from_above = env.render()[:480]
        frames = Frames.of_states(states, env.scene())
    drawn = np.argwhere((seen_from_above == PEG).all(axis=2))[:, ::-1] - [400, 240]
    pixels, way = 4.0 * 800 / 2.8, states[1].obstacle_position[0] - [BALL.x, BALL.y]
    assert np.hypot(*way) > 0.02
    np.testing.assert_allclose(drawn.mean(axis=0) / pixels * [1.0, -1.0], way, atol=2.0 / pixels)
    assert len(drawn) / pixels**2 == pytest.approx(np.pi * (0.86 * BALL.radius) ** 2, rel=0.05)
    server = viser.ViserServer(port=0, verbose=False)
    try:
        drawing = Drawing(server.scene, frames)
        np.testing.assert_allclose(drawing._balls.batched_scales[:, 0], [BALL.radius, DROPPED.radius])
        drawing.show(frames, 1)
        shown = drawing._balls.batched_positions
        np.testing.assert_allclose(shown[:, :2], states[1].obstacle_position[[0, 2]])
        np.testing.assert_allclose(shown[:, 2], states[1].obstacle_height[[0, 2]])
    finally:
        server.stop()


def test_balls_roll_slide_and_meet_as_in_mujoco():
    """Down a slope: one rolls, one slides, one has rolling friction, and one rolls down a ramp.

    Where rolling friction resists, MuJoCo's ball hovers and hops. It runs ahead by a few percent of what this takes.
    """
    robot, away = Robot(links=2), Start(position=(0.0, -6.0), posture="straight")
    rolls = Sphere(0.07, 0.0, 0.0, 0.5, ground_friction=0.9, rolling_friction=0.0)
    slides = Sphere(0.07, 0.0, 1.0, 0.5, ground_friction=0.05, rolling_friction=0.0)
    resisted = Sphere(0.07, 0.0, 2.0, 0.5, ground_friction=0.9, rolling_friction=0.03)
    ramp = Polyhedron([(x, y, z) for y in (2.5, 3.5) for x, z in [(0.0, 0.0), (-1.0, 0.0), (-1.0, 0.4)]], friction=0.5)
    raised = Sphere(0.05, -0.5, 3.0, 0.2, z=0.2 + 0.05 * np.hypot(1.0, 0.4), rolling_friction=0.0)
    scene = Scene(obstacles=[rolls, slides, resisted, ramp, raised], friction=(0.9, 0.9), slope=(0.3, np.pi))
    model, data = in_mujoco(scene, robot=robot, start=away, step=1e-4)
    bodies = [data.body(f"obstacle_{j}") for j in (1, 2, 3, 5)]
    np.testing.assert_allclose(bodies[3].xpos, [raised.x, raised.y, raised.z], atol=1e-12)
    assert model.body("obstacle_1").inertia[1] == pytest.approx(0.4 * 0.5 * 0.07**2)
    ours = snake_env.simulate("spatial", scene=scene, robot=robot, start=away, duration=0.5, sample=0.1)
    theirs = []
    for _ in range(6):
        theirs.append([body.xpos.copy() for body in bodies])
        advance(model, data, 0.1)
    way = ours.obstacle_position[-1, :, 0] - ours.obstacle_position[0, :, 0]
    assert way[1] > way[0] > way[2] > 0.2
    assert ours.obstacle_height[0, 3] - ours.obstacle_height[-1, 3] > 0.15
    found = np.concatenate([ours.obstacle_position, ours.obstacle_height[..., np.newaxis]], axis=2)
    np.testing.assert_allclose(found[:, [0, 1, 3]], np.array(theirs)[:, [0, 1, 3]], atol=3e-4)
    np.testing.assert_allclose(found[:, 2], np.array(theirs)[:, 2], atol=1.2e-3)
    assert way[0] - way[2] > 0.02
