"""Obstacles that can be pushed: simulate, files, pictures, environments and MuJoCo."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from conftest import advance, check_arrays, check_continues, in_mujoco

import snake_env
from snake_env import ConfigError, Integrator, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start, load_trajectory
from snake_env.obstacles import Box, Circle, Cylinder, Polygon, Segment, is_movable

PUSHED = Circle(0.08, -0.2, 0.02, mass=0.5, ground_friction=0.3)
FAR = Circle(0.05, 0.0, 5.0, mass=0.2)
YIELDS = Circle(0.08, -0.2, 0.02, mass=0.5, stiffness=200.0, damping=3.0, travel=0.03)
HEAP = Scene(obstacles=[(0.1, 0.4, 0.6), PUSHED, Segment((-3.0, -2.0), (3.0, -2.0)), FAR], friction=(0.1, 0.6))
"""What the head of a robot that moves towards -x meets, among fixed obstacles."""
ALONE = Scene(obstacles=[PUSHED])
AHEAD = Start(position=(0.0, 0.0), heading=0.0, posture="gait")
CRATE = Box((0.15, 0.1), -0.2, 0.06, 0.3, mass=0.4, ground_friction=0.3)
WEDGE = Polygon([(0.0, 3.0), (0.3, 3.0), (0.0, 3.2)], mass=0.3)
BOXES = Scene(obstacles=[(0.1, 0.4, 0.6), CRATE, WEDGE], friction=(0.1, 0.6))
POLE = Cylinder((3.0, 0.0, 0.1), (4.0, 0.0, 0.1), radius=0.05)


def pushing(**options):
    return snake_env.simulate(scene=HEAP, start=AHEAD, duration=3.0, sample=0.1, **options)


def test_a_trajectory_has_the_discs_and_the_forces_on_them_balance():
    run = pushing(record=["velocity", "obstacles", "ground"])
    check_arrays(run, obstacle_position=(2, 2), obstacle_angle=(2,), obstacle_velocity=(2, 2), obstacle_force=(4, 2))
    np.testing.assert_array_equal(run.obstacle_position[0], [[PUSHED.x, PUSHED.y], [FAR.x, FAR.y]])
    way = run.obstacle_position[-1] - run.obstacle_position[0]
    assert np.hypot(*way[0]) > 0.05
    np.testing.assert_array_equal(run.obstacle_position[:, 1], np.tile([FAR.x, FAR.y], (31, 1)))
    np.testing.assert_allclose(run.obstacle_force.sum(axis=1), run.contact_force.sum(axis=1), atol=1e-9)
    assert (run.obstacle_force[:, [0, 2, 3]] == 0.0).all()
    impulse = (run.obstacle_force + 0.0).sum(axis=1)[1:] + run.ground_friction[1:].sum(axis=(1, 2))
    change = np.diff(7.5 / 11.0 * run.velocity.sum(axis=1), axis=0)
    np.testing.assert_allclose(change, 0.1 * impulse, atol=2e-3)
    assert run.max_penetration < 1e-3
    assert not run.unconverged.any()


def test_rows_of_a_run_survive_files(tmp_path):
    run = pushing()
    for ending in ("npz", "csv"):
        again = load_trajectory(run.save(tmp_path / f"run.{ending}"))
        np.testing.assert_array_equal(again.obstacle_position, run.obstacle_position)
        assert again.scene == HEAP


def test_scenes_with_discs_survive_files_and_know_where_they_are(tmp_path):
    HEAP.save(tmp_path / "heap.json")
    assert Scene.load(tmp_path / "heap.json") == HEAP
    there = HEAP.with_obstacles_at(np.array([[1.0, 2.0], [3.0, 4.0]]))
    assert [(one.x, one.y) for one in (there.obstacles[1], there.obstacles[3])] == [(1.0, 2.0), (3.0, 4.0)]
    assert there.obstacles[0] == HEAP.obstacles[0]
    assert (there.obstacles[1].mass, there.obstacles[1].ground_friction) == (0.5, 0.3)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Circle(0.1, 0.0, 0.0, mass=-1.0), "obstacle.mass"),
        (lambda: Circle(0.1, 0.0, 0.0, mass=1.0, ground_friction=-0.1), "obstacle.ground_friction"),
        (lambda: Circle(0.1, 0.0, 0.0, mass=1.0, friction=0.3), "obstacle.friction"),
        (lambda: Circle(0.1, 0.0, 0.0, mass=1.0, stiffness=-1.0), "obstacle.stiffness"),
        (lambda: Circle(0.1, 0.0, 0.0, stiffness=1.0), "obstacle.stiffness"),
        (lambda: Circle(0.1, 0.0, 0.0, mass=1.0, stiffness=1.0, damping=-1.0), "obstacle.damping"),
        (lambda: Circle(0.1, 0.0, 0.0, mass=1.0, stiffness=1.0, travel=0.0), "obstacle.travel"),
        (lambda: Segment((0.0, 0.0), (1.0, 0.0), mass=1.0), "obstacle.mass"),
        (lambda: Box((0.1, 0.1), 0.0, 0.0, mass=0.0), "obstacle.mass"),
        (lambda: Box((0.1, 0.1), 0.0, 0.0, mass=1.0, friction=0.2), "obstacle.friction"),
        (lambda: Box((0.1, 0.1), 0.0, 0.0, mass=1.0, ground_friction=-1.0), "obstacle.ground_friction"),
        (lambda: Polygon([(0, 0), (1, 0), (0, 1)], mass=-2.0), "obstacle.mass"),
        (lambda: Polygon([(0, 0), (1, 0), (0.2, 0.2), (0, 1)], mass=1.0), "obstacle.vertices[2]"),
        (lambda: snake_env.simulate(scene=Scene(obstacles=[CRATE, replace(CRATE, x=-0.15)])), "scene.obstacles[1]"),
        (lambda: SnakeEnv(scene=Scene(obstacles=[CRATE, (0.1, -0.2, 0.2)]), start=AHEAD), "scene.obstacles[0]"),
        (lambda: Box((0.1, 0.1), 0.0, 0.0, mass=1.0, height=0.1), "obstacle.height"),
        (lambda: snake_env.simulate("spatial", scene=Scene(obstacles=[CRATE, POLE])), "scene.obstacles[1]"),
        (lambda: SnakeEnv(model="spatial", scene=Scene(obstacles=[POLE, CRATE]), start=AHEAD), "scene.obstacles[0]"),
        (lambda: snake_env.simulate(scene=ALONE, integrator=Integrator("thesis")), "scene.obstacles[0].mass"),
        (
            lambda: snake_env.simulate("spatial", scene=ALONE, integrator=Integrator("thesis")),
            "scene.obstacles[0].mass",
        ),
        (lambda: Scene(obstacles=[PUSHED], friction=(0.1, 0.6), friction_backward=0.3), "scene.friction_backward"),
    ],
)
def test_what_cannot_be_pushed_is_refused_by_name(make, field):
    with pytest.raises(ConfigError) as refused:
        make()
    assert refused.value.field == field


def test_environments_have_discs_in_state_observation_and_saved_states():
    env = SnakeEnv(scene=HEAP, start=AHEAD, start_jitter=0.0, observation="dict", render_mode="rgb_array")
    observation, _ = env.reset(seed=0)
    assert env.state().obstacle_position.shape == (2, 2)
    np.testing.assert_array_equal(env.state().obstacle_position[0], [PUSHED.x, PUSHED.y])
    picture = env.render()
    for _ in range(60):
        env.step(np.zeros(env.action_space.shape))
    moved = env.state().obstacle_position[0]
    assert np.hypot(*(moved - [PUSHED.x, PUSHED.y])) > 0.05
    assert (env.render() != picture).any()
    check_continues(env, "obstacle_position")
    env.reset(seed=1)
    np.testing.assert_array_equal(env.state().obstacle_position[0], [PUSHED.x, PUSHED.y])
    assert "pegs" in observation


def test_a_disc_is_located_like_a_peg_at_the_same_place():
    def seen(obstacle, blocks=("pegs", "range")):
        scene = Scene(obstacles=[obstacle, (0.1, -0.5, 0.4)])
        env = SnakeEnv(scene=scene, start=AHEAD, start_jitter=0.0, observation="dict", observation_blocks=list(blocks))
        return env.reset(seed=0)[0]

    disc, peg = seen(PUSHED), seen((PUSHED.radius, PUSHED.x, PUSHED.y))
    for name in ("pegs", "range"):
        np.testing.assert_array_equal(disc[name], peg[name])


def test_robots_of_a_batch_have_discs_of_their_own():
    ground = HEAP.friction
    scenes = [Scene(obstacles=[(0.1, 0.0, 3.0)], friction=ground), HEAP, Scene(obstacles=[FAR], friction=ground)]
    with closing(SnakeVectorEnv(12, scene=scenes, start=AHEAD, start_jitter=0.0)) as envs:
        envs.reset(seed=0)
        for _ in range(40):
            envs.step(np.zeros(envs.action_space.shape, np.float32))
        together, drawn = envs.state(), [envs.scene(i) for i in range(12)]
    counts = [sum(map(is_movable, scene.obstacles)) for scene in drawn]
    assert set(counts) == {0, 1, 2}
    assert np.isfinite(together.obstacle_position).all(axis=2).sum(axis=1).tolist() == counts
    for i, scene in enumerate(drawn):
        with closing(SnakeVectorEnv(1, scene=scene, start=AHEAD, start_jitter=0.0)) as alone:
            alone.reset(seed=0)
            for _ in range(40):
                alone.step(np.zeros(alone.action_space.shape, np.float32))
            row = together.robot(i)
            np.testing.assert_array_equal(alone.state().robot(0).link_position, row.link_position)
            np.testing.assert_array_equal(alone.state().robot(0).obstacle_position, row.obstacle_position)


def test_a_peg_that_yields_survives_files_and_gives_way_up_to_its_stop(tmp_path):
    scene = Scene(obstacles=[YIELDS, (0.1, 0.4, 0.6)], friction=(0.1, 0.6))
    scene.save(tmp_path / "yields.json")
    assert Scene.load(tmp_path / "yields.json") == scene
    run = snake_env.simulate(scene=scene, start=AHEAD, duration=3.0, sample=0.05, record=["obstacles"])
    assert load_trajectory(run.save(tmp_path / "run.npz")).scene == scene
    way = np.linalg.norm(run.obstacle_position[:, 0] - [YIELDS.x, YIELDS.y], axis=1)
    assert 0.02 < way.max() < YIELDS.travel + 1e-4
    assert np.linalg.norm(run.obstacle_force[:, 0], axis=1).max() > 5.0
    assert run.max_penetration < 1e-3
    with pytest.raises(ConfigError, match="circle"):
        Circle(0.1, 0.0, 0.0, mass=1.0, travel=0.1)
    with closing(SnakeEnv(scene=scene, start=AHEAD, start_jitter=0.0, render_mode="rgb_array")) as env:
        env.reset(seed=0)
        first = env.render()
        for _ in range(30):
            env.step(np.zeros(env.action_space.shape))
        assert (env.render() != first).any()
        saved, place = env.get_state(), env.state().obstacle_position
        env.reset(seed=1)
        env.set_state(saved)
        np.testing.assert_array_equal(env.state().obstacle_position, place)


def test_pictures_and_viewer_show_how_far_a_spring_is_drawn_out():
    pytest.importorskip("pygame")
    pytest.importorskip("viser")
    from snake_env.palette import SPRING, SPRING_WIDTH
    from snake_env.viewer.drawing import springs_in
    from snake_env.viewer.frames import Frames

    scene = Scene(obstacles=[(0.1, 0.4, 0.6), FAR, YIELDS], friction=(0.1, 0.6))
    picture = {"camera": "fixed", "centre": (YIELDS.x, YIELDS.y), "layers": ("obstacles",), "zoom": 4.0}
    with closing(SnakeEnv(scene=scene, start=AHEAD, start_jitter=0.0, render_mode="rgb_array", picture=picture)) as env:
        env.reset(seed=0)
        while np.linalg.norm(env.state().obstacle_position[1] - [YIELDS.x, YIELDS.y]) < 0.02:
            env.step(np.zeros(env.action_space.shape))
        place = env.state().obstacle_position[1]
        drawn = np.argwhere((env.render() == SPRING).all(axis=2))[:, ::-1] - [400, 240]
        ((home, peg),) = springs_in(Frames.of_states([env.state()], env.scene()), 0)
    np.testing.assert_allclose([home[:2], peg[:2]], [[YIELDS.x, YIELDS.y], place])
    pixels = 4.0 * 800 / 2.8
    way = pixels * (place - home[:2]) * [1.0, -1.0]
    along = drawn @ way / np.linalg.norm(way)
    assert along.min() == pytest.approx(-pixels * SPRING_WIDTH, abs=2.0)
    assert along.max() == pytest.approx(max(pixels * SPRING_WIDTH, np.linalg.norm(way)), abs=3.0)


def test_a_peg_yields_under_its_weight_as_in_mujoco():
    """Down a slope: one swings about its rest, one with friction stops before it, one meets its stop."""
    robot = Robot(links=2)
    away = Start(position=(0.0, -4.0), posture="straight")
    free = Circle(0.08, 0.3, 0.0, mass=1.0, stiffness=60.0, damping=3.0)
    rough = Circle(0.08, 0.3, 1.0, mass=1.0, ground_friction=0.1, stiffness=60.0)
    stopped = Circle(0.08, 0.0, 2.0, mass=1.0, stiffness=60.0, damping=3.0, travel=0.02)
    scene = Scene(obstacles=[free, rough, stopped], friction=(0.9, 0.9), slope=(0.3, np.pi))
    model, data = in_mujoco(scene, robot=robot, start=away, step=1e-4)
    ours = snake_env.simulate(scene=scene, robot=robot, start=away, duration=3.0, sample=0.1)
    theirs = [[[one.x, one.y] for one in scene.obstacles]]
    for _ in range(30):
        advance(model, data, 0.1)
        theirs.append([data.body(f"obstacle_{j}").xpos[:2].copy() for j in (1, 2, 3)])
    way = ours.obstacle_position[..., 0] - [one.x for one in scene.obstacles]
    rest = 9.81 * np.sin(0.3) / 60.0
    assert way[:, 0].max() > 1.3 * rest
    assert way[-1, 0] == pytest.approx(rest, abs=1e-3)
    # Friction of the ground holds it within the deflection that it balances.
    assert abs(way[-1, 1] - rest) < 0.1 * 9.81 * np.cos(0.3) / 60.0
    assert abs(way[-1, 1] - way[-2, 1]) < 1e-9
    assert way[-1, 2] == pytest.approx(0.02, abs=1e-6)
    np.testing.assert_allclose(ours.obstacle_position[:, [0, 2]], np.array(theirs)[:, [0, 2]], atol=5e-4)
    # MuJoCo's friction gives way before it holds.
    np.testing.assert_allclose(ours.obstacle_position[:, 1], np.array(theirs)[:, 1], atol=3e-3)


def test_a_disc_that_slides_into_another_moves_as_in_mujoco():
    """Down a slope that holds the robot and the second disc: an impact off the line of centres, and what follows."""
    robot = Robot(links=2)
    away = Start(position=(0.0, -4.0), posture="straight")
    first = Circle(0.1, 0.0, 0.0, mass=2.0, ground_friction=0.1)
    second = Circle(0.08, 0.5, 0.06, mass=1.0, ground_friction=0.4)
    scene = Scene(obstacles=[first, second], friction=(0.9, 0.9), slope=(0.3, np.pi))
    model, data = in_mujoco(scene, robot=robot, start=away, step=1e-4)
    np.testing.assert_allclose(data.body("obstacle_2").xpos[:2], [second.x, second.y])
    assert model.body("obstacle_1").mass[0] == pytest.approx(2.0)
    ours = snake_env.simulate(scene=scene, robot=robot, start=away, duration=0.9, sample=0.3)
    theirs = [np.array([data.body(f"obstacle_{j}").xpos[:2] for j in (1, 2)])]
    for _ in range(3):
        advance(model, data, 0.3)
        theirs.append(np.array([data.body(f"obstacle_{j}").xpos[:2] for j in (1, 2)]))
    assert ours.obstacle_position[-1, 1, 0] > second.x + 0.2
    np.testing.assert_allclose(ours.obstacle_position[1], theirs[1], atol=1e-4)
    # MuJoCo's discs rebound a little: a few hundredths of the speed at which they meet.
    np.testing.assert_allclose(ours.obstacle_position, theirs, atol=1e-2)


def test_boxes_are_pushed_turn_and_survive_files(tmp_path):
    run = snake_env.simulate(scene=BOXES, start=AHEAD, duration=3.0, sample=0.1, record=["obstacles"])
    check_arrays(run, obstacle_position=(2, 2), obstacle_angle=(2,), obstacle_force=(3, 2))
    np.testing.assert_allclose(run.obstacle_position[0], [[CRATE.x, CRATE.y], [0.1, 3.2 - 0.4 / 3.0]], atol=1e-12)
    assert np.hypot(*(run.obstacle_position[-1, 0] - [CRATE.x, CRATE.y])) > 0.05
    assert abs(run.obstacle_angle[-1, 0]) > 0.05
    np.testing.assert_array_equal(run.obstacle_position[:, 1], np.tile(run.obstacle_position[0, 1], (31, 1)))
    assert run.max_penetration < 1e-3
    assert not run.unconverged.any()
    BOXES.save(tmp_path / "boxes.json")
    assert Scene.load(tmp_path / "boxes.json") == BOXES
    again = load_trajectory(run.save(tmp_path / "run.npz"))
    assert again.scene == BOXES
    np.testing.assert_array_equal(again.obstacle_angle, run.obstacle_angle)


def test_a_scene_knows_boxes_where_they_are_and_how_they_are_turned():
    there = BOXES.with_obstacles_at(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([0.2, np.pi / 2.0]))
    assert (there.obstacles[1].x, there.obstacles[1].y, there.obstacles[1].angle) == (1.0, 2.0, 0.5)
    # A quarter turn of the corners about the centroid.
    arms = np.array(WEDGE.vertices) - [0.1, 3.2 - 0.4 / 3.0]
    np.testing.assert_allclose(there.obstacles[2].vertices, arms @ [[0.0, 1.0], [-1.0, 0.0]] + [3.0, 4.0], atol=1e-12)
    assert there.obstacles[0] == BOXES.obstacles[0]


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_environments_have_boxes_in_state_observation_pictures_and_saved_states(model):
    options = {"model": model, "start": AHEAD, "start_jitter": 0.0, "observation": "dict"}
    options["observation_blocks"] = ["pegs", "range"]
    with closing(SnakeEnv(scene=BOXES, render_mode="rgb_array", **options)) as env:
        first, _ = env.reset(seed=0)
        assert env.state().obstacle_position.shape == (2, 2)
        np.testing.assert_array_equal(env.state().obstacle_angle, [0.0, 0.0])
        picture = env.render()
        for _ in range(60):
            env.step(np.zeros(env.action_space.shape))
        state = env.state()
        assert np.linalg.norm(state.obstacle_position[0] - [CRATE.x, CRATE.y]) > 0.02
        assert abs(state.obstacle_angle[0]) > 0.02
        assert (env.render() != picture).any()
        for quantity in ("obstacle_position", "obstacle_angle"):
            check_continues(env, quantity)
    # At the start it is seen like a fixed one; later like a fixed one that has been put where it is.
    fixed = Scene(obstacles=[BOXES.obstacles[0], replace(CRATE, mass=None, ground_friction=None)], friction=(0.1, 0.6))
    with closing(SnakeEnv(scene=fixed, **options)) as env:
        seen, _ = env.reset(seed=0)
    for name in options["observation_blocks"]:
        np.testing.assert_allclose(first[name], seen[name], atol=1e-6)


def test_a_turned_box_is_located_as_it_lies():
    """The same box written at an angle, and turned to it by a collision-free spin of the state."""
    turned = BOXES.with_obstacles_at([[-0.3, 0.1], [0.1, 3.0]], [0.9, 0.0])
    options = {"start": AHEAD, "start_jitter": 0.0, "observation": "dict", "observation_blocks": ["pegs", "range"]}
    with closing(SnakeEnv(scene=turned, **options)) as env:
        expected, _ = env.reset(seed=0)
    still = replace(turned.obstacles[1], mass=None, ground_friction=None)
    with closing(SnakeEnv(scene=Scene(obstacles=[turned.obstacles[0], still], friction=(0.1, 0.6)), **options)) as env:
        seen, _ = env.reset(seed=0)
    for name in ("pegs", "range"):
        np.testing.assert_allclose(seen[name], expected[name], atol=1e-6)


def test_pictures_and_viewer_show_boxes_where_they_are():
    pytest.importorskip("pygame")
    viser = pytest.importorskip("viser")
    from snake_env.palette import PEG
    from snake_env.viewer.drawing import Drawing
    from snake_env.viewer.frames import Frames

    picture = {"camera": "fixed", "centre": (CRATE.x, CRATE.y), "layers": ("obstacles",), "zoom": 4.0}
    with closing(SnakeEnv(scene=BOXES, start=AHEAD, start_jitter=0.0, render_mode="rgb_array", picture=picture)) as env:
        env.reset(seed=0)
        states = [env.state()]
        for _ in range(60):
            env.step(np.zeros(env.action_space.shape))
        states.append(env.state())
        drawn = np.argwhere((env.render() == PEG).all(axis=2))[:, ::-1] - [400, 240]
        frames = Frames.of_states(states, env.scene())
    pixels = 4.0 * 800 / 2.8
    place = states[1].obstacle_position[0]
    np.testing.assert_allclose(drawn.mean(axis=0) / pixels * [1.0, -1.0], place - [CRATE.x, CRATE.y], atol=4.0 / pixels)
    covariance = np.cov((drawn * [1.0, -1.0]).T)
    angle = 0.5 * np.arctan2(2.0 * covariance[0, 1], covariance[0, 0] - covariance[1, 1])
    turn = angle - CRATE.angle - states[1].obstacle_angle[0]
    assert abs((turn + np.pi / 2.0) % np.pi - np.pi / 2.0) < 0.03
    server = viser.ViserServer(port=0, verbose=False)
    try:
        drawing = Drawing(server.scene, frames)
        drawing.show(frames, 1)
        ((j, handle), _) = drawing._moving
        assert j == 0
        np.testing.assert_allclose(handle.position[:2], place)
        assert 2.0 * np.arctan2(handle.wxyz[3], handle.wxyz[0]) == pytest.approx(states[1].obstacle_angle[0])
    finally:
        server.stop()


def test_boxes_slide_and_turn_as_in_mujoco():
    """Down a slope, without friction a box and a wedge meet fixed pegs off their centres, and turn; a rough box slides.

    MuJoCo's friction acts at the corners of a box, so that rough ones are alike only while they do not turn.
    """
    robot = Robot(links=2)
    away = Start(position=(0.0, -6.0), posture="straight")
    box = Box((0.2, 0.3), 0.0, 0.0, 0.2, mass=2.0, ground_friction=0.0)
    wedge = Polygon([(0.0, 4.0), (0.3, 4.0), (0.3, 4.2)], mass=1.0, ground_friction=0.0)
    rough = Box((0.2, 0.3), 0.0, 2.0, 0.7, mass=1.0, ground_friction=0.1)
    pegs = [(0.05, 0.6, 0.12), (0.05, 0.8, 4.0)]
    scene = Scene(obstacles=[box, wedge, rough, *pegs], friction=(0.9, 0.9), slope=(0.3, np.pi))
    model, data = in_mujoco(scene, robot=robot, start=away, step=1e-4)
    np.testing.assert_allclose(data.body("obstacle_2").xpos[:2], [0.2, 4.0 + 0.2 / 3.0], atol=1e-12)
    assert model.body("obstacle_1").inertia[2] == pytest.approx(2.0 * (0.2**2 + 0.3**2) / 12.0)
    bodies = [data.body(f"obstacle_{j}") for j in (1, 2, 3)]
    headings = [np.arctan2(body.xmat[3], body.xmat[0]) for body in bodies]
    ours = snake_env.simulate(scene=scene, robot=robot, start=away, duration=0.75, sample=0.05)
    places, turns = [], []
    for _ in range(16):
        places.append([body.xpos[:2].copy() for body in bodies])
        turn = [np.arctan2(body.xmat[3], body.xmat[0]) - first for body, first in zip(bodies, headings, strict=True)]
        turns.append((np.array(turn) + np.pi) % (2.0 * np.pi) - np.pi)
        advance(model, data, 0.05)
    assert np.abs(ours.obstacle_angle[-1, :2]).min() > 0.1
    assert ours.max_penetration < 1e-3
    np.testing.assert_allclose(ours.obstacle_position[:, 2], np.array(places)[:, 2], atol=2e-4)
    # MuJoCo's contacts are soft, and rebound a little.
    np.testing.assert_allclose(ours.obstacle_position, places, atol=1e-2)
    np.testing.assert_allclose(ours.obstacle_angle, turns, atol=4e-2)


def test_trajectories_in_3d_have_what_is_pushed(tmp_path):
    scene = Scene(obstacles=[(0.1, 0.4, 0.6), PUSHED, WEDGE, replace(YIELDS, x=-0.3, y=-0.3)], friction=(0.1, 0.6))
    run = snake_env.simulate(
        "spatial", scene=scene, start=AHEAD, duration=3.0, sample=0.1, record=["velocity", "obstacles"]
    )
    check_arrays(run, obstacle_position=(3, 2), obstacle_angle=(3,), obstacle_velocity=(3, 2), obstacle_force=(4, 3))
    way = np.linalg.norm(run.obstacle_position[-1] - run.obstacle_position[0], axis=1)
    assert way[0] > 0.05
    assert way[1] == 0.0
    np.testing.assert_allclose(run.obstacle_force.sum(axis=1), run.contact_force.sum(axis=1), atol=1e-9)
    assert abs(run.obstacle_force[:, 1, 2]).max() == 0.0
    assert run.max_penetration < 1e-3
    assert not run.unconverged.any()
    again = load_trajectory(run.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(again.obstacle_position, run.obstacle_position)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_states_in_which_boxes_press_on_each_other_can_be_restored(model):
    """Eight vertices describe the contact of two boxes."""
    second = Box((0.15, 0.1), -0.41, 0.05, 0.05, mass=0.4, ground_friction=0.3)
    scene = Scene(obstacles=[replace(CRATE, x=-0.25, y=0.03, angle=0.0), second], friction=(0.1, 0.6))
    with closing(SnakeEnv(model=model, scene=scene, start=AHEAD, start_jitter=0.0)) as env:
        env.reset(seed=0)
        for _ in range(40):
            env.step(np.zeros(env.action_space.shape))
            env.set_state(env.get_state())
        assert env.state().obstacle_position[1, 0] < second.x - 0.005


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_state_from_right_after_a_reset_can_be_restored_whatever_there_was_before(model):
    discs = [Circle(0.08, -0.3 * (k + 1), 0.02, mass=0.5, ground_friction=0.3) for k in range(3)]
    few, many = (Scene(obstacles=[(0.1, 0.0, 3.0), *discs[:count]], friction=(0.1, 0.6)) for count in (1, 3))
    for before, after in [(few, many), (many, few)]:
        with closing(SnakeEnv(model=model, scene=before, start=AHEAD, start_jitter=0.0)) as env:
            env.reset(seed=0)
            env.step(np.zeros(env.action_space.shape))
            env.reset(seed=0, options={"scene": after})
            env.set_state(env.get_state())
            env.step(np.zeros(env.action_space.shape))


@pytest.mark.parametrize("speed", [1.8, 2.0, 2.2])
def test_a_fast_box_does_not_pass_through_one_that_is_thinner_than_the_links(speed):
    fast = Box((0.1, 0.6), -0.531, -0.021, mass=0.05, ground_friction=0.05)
    thin = Box((0.02, 0.6), -0.641, 0.0, mass=5.0, ground_friction=0.05)
    scene = Scene(obstacles=[fast, thin], friction=(0.1, 0.6))
    start = Start(position=(0.0, 0.0), heading=0.0, posture="straight")
    with closing(
        SnakeEnv(scene=scene, start=start, start_jitter=0.0, control_period=0.02, action_mode="joints")
    ) as env:
        env.reset(seed=0)
        impulse = np.zeros((11, 2))
        impulse[:, 0] = -0.68 * speed
        env.unwrapped.push(impulse)
        for _ in range(16):
            env.step(np.zeros(env.action_space.shape))
            state = env.state()
            angle, other = state.obstacle_angle
            corner = state.obstacle_position[0] + turned((-0.05, 0.3), angle) - state.obstacle_position[1]
            assert turned(corner, -other)[0] > 0.009
        assert state.obstacle_position[1, 0] < thin.x - 1e-4


def turned(point, angle):
    """A point of the plane, turned about the origin."""
    (x, y), c, s = point, np.cos(angle), np.sin(angle)
    return np.array([c * x - s * y, s * x + c * y])
