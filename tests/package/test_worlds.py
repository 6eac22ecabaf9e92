"""Scenes, starts and goals of the user's own, in environments."""

from __future__ import annotations

import math
import time

import gymnasium as gym
import numpy as np
import pytest

from snake_env import ConfigError, Scene, SnakeEnv, SnakeVectorEnv, Start
from snake_env.obstacles import Box
from snake_env.testing import assert_identical, check_vector_env

RING = Scene(obstacles=[(0.05, x, y) for x in (-1.5, 1.5) for y in (-0.5, 0.5)])
"""Pegs around a start at the origin."""
FAR = Scene(obstacles=[(0.1, 3.0, 0.3)], friction=(0.2, 0.5))
BESIDE = Start(position=(0.6, 5.0), heading=math.pi, posture="straight")


def drawn(rng, difficulty):
    """A generator: a few pegs ahead of the robot, more with difficulty."""
    count = 1 + int(4 * difficulty)
    return Scene(obstacles=[(0.05, rng.uniform(1.2, 3.0), rng.uniform(-1.0, 1.0)) for _ in range(count)])


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_scene_takes_the_place_of_pegs_and_ground(model):
    env = gym.make_vec("SnakeField-v1", num_envs=3, scene=FAR, model=model)
    env.reset(seed=0)
    for i in range(3):
        assert env.unwrapped.scene(i).obstacles == FAR.obstacles
        assert env.unwrapped.scene(i).friction == (0.2, 0.5)
    for _ in range(3):
        env.step(np.zeros(env.action_space.shape))
    assert env.unwrapped.state().time.tolist() == pytest.approx([0.15] * 3)


def test_a_robot_slides_along_the_pegs_of_its_scene():
    """A wall of pegs right ahead stops a robot that gets ahead without it."""
    wall = Scene(obstacles=[(0.05, 1.0, -1.0 + 0.1 * k) for k in range(21)], friction=(0.2, 0.5))
    open_ground = Scene(friction=(0.2, 0.5))
    distance = []
    for scene in (wall, open_ground):
        env = SnakeEnv(task="field", scene=scene, start_jitter=0.0, goal_distance=3.0)
        env.reset(seed=0)
        for _ in range(200):
            env.step(np.zeros(4))
        distance.append(float(env.state().distance))
    assert distance[0] < 0.7 * distance[1]


def test_a_start_is_taken_exactly():
    env = SnakeEnv(task="field", scene=FAR, start=BESIDE)
    env.reset(seed=0)
    state = env.state()
    np.testing.assert_allclose(state.link_position[0], (0.6, 5.0), atol=1e-12)
    np.testing.assert_allclose(state.joint_angle, 0.0, atol=1e-12)
    np.testing.assert_allclose(state.link_angle, math.pi, atol=1e-12)
    assert state.goal[1] == pytest.approx(5.0)
    env.step(np.zeros(4))
    assert np.abs(env.state().joint_rate).max() < 3.0
    assert not env.step(np.zeros(4))[2]


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_preset_course_has_its_start(model):
    env = SnakeEnv(task="field", scene=Scene.preset("table-7.5"), model=model)
    env.reset(seed=0)
    start = Start.on_course(Scene.preset("table-7.5"), model)
    np.testing.assert_allclose(env.state().link_position[0, :2], start.position, atol=1e-12)


@pytest.mark.parametrize(
    ("goal", "point", "radius"),
    [
        ((1.0, 2.0), (1.0, 2.0), 0.25),
        (np.array([1.0, 2.0]), (1.0, 2.0), 0.25),
        ((1.0, 2.0, 0.4), (1.0, 2.0), 0.4),
        (1.5, None, 0.0),
        (np.float32(1.5), None, 0.0),
    ],
)
def test_a_goal_is_a_point_or_a_line(goal, point, radius):
    env = SnakeEnv(task="field", goal=goal)
    env.reset(seed=0)
    state = env.state()
    assert state.goal_radius == radius
    if point is None:
        assert state.goal[0] - state.position[0] == pytest.approx(1.5)
    else:
        np.testing.assert_array_equal(state.goal, point)


@pytest.mark.parametrize("goal", [{}, {"goal": 1.5}, {"goal": (3.0, 0.3)}])
def test_a_corridor_has_a_centre_line_and_a_width(goal):
    """The deprecated keyword is the same."""
    line = {"distance": goal["goal"]} if goal.get("goal") == 1.5 else {}
    own = goal if "goal" in goal and not line else {"goal": {**line, "centre_line": 0.3}}
    env = SnakeEnv(task="free", corridor_half_width=0.7, **own)
    with pytest.warns(DeprecationWarning, match="corridor_half_width"):
        former = SnakeEnv(task="free", corridor=(0.3, 0.7), **goal)
    for one in (env, former):
        one.reset(seed=0)
        assert (one.state().goal[1], one.state().corridor_half_width) == (0.3, 0.7)
    assert_identical(env.state().arrays(), former.state().arrays(), "by either keyword")


def test_generated_scenes_depend_on_seed_episode_and_difficulty():
    env = SnakeVectorEnv(4, task="field", scene=drawn, difficulty=0.5)
    env.reset(seed=3)
    first = [env.scene(i) for i in range(4)]
    env.reset()
    second = [env.scene(i) for i in range(4)]
    assert len({str(scene.obstacles) for scene in first + second}) == 8
    single = SnakeEnv(task="field", scene=drawn, difficulty=0.5)
    single.reset(seed=5)
    assert single.scene() == first[2]
    single.reset()
    assert single.scene() == second[2]
    env.set_difficulty(1.0)
    env.reset()
    assert len(env.scene(0).obstacles) == 5


@pytest.mark.parametrize("scene", [RING, [RING, Scene()], drawn])
def test_own_scenes_keep_the_rules_of_batches(scene):
    """Same results for any batch size, thread count and autoreset mode, in copies and after a restored state."""
    options = {"task": "field", "scene": scene, "max_episode_steps": 5}
    check_vector_env(lambda **given: SnakeVectorEnv(**options, **given), lambda: SnakeEnv(**options), steps=12)
    runs = []
    for threads in (1, 2):
        env = SnakeVectorEnv(20, num_threads=threads, **options)
        runs.append([env.reset(seed=0), *(env.step(np.full((20, 4), 0.5)) for _ in range(12))])
    assert_identical(*runs, "one and two threads")


def test_a_scene_is_read_from_its_file(tmp_path):
    path = tmp_path / "ring.json"
    RING.save(path)
    env = SnakeVectorEnv(2, task="field", scene=str(path))
    env.reset(seed=0)
    assert len(env.scene(1).obstacles) == 4


def test_a_list_of_scenes_is_drawn_from():
    env = SnakeVectorEnv(16, task="field", scene=[RING, Scene()])
    env.reset(seed=0)
    assert {len(env.scene(i).obstacles) for i in range(16)} == {0, 4}


def test_options_of_a_reset_count_for_the_episodes_it_begins():
    env = SnakeVectorEnv(3, task="field", max_episode_steps=2, autoreset_mode="SameStep")
    env.reset(seed=0, options={"scene": [RING, None, RING], "goal": (2.0, 1.0), "difficulty": [0.0, 0.25, 1.0]})
    assert [len(env.scene(i).obstacles) for i in (0, 2)] == [4, 4]
    plain = SnakeVectorEnv(3, task="field", difficulty=0.25)
    plain.reset(seed=0)
    assert env.scene(1) == plain.scene(1)
    assert (env.state().goal == (2.0, 1.0)).all()
    assert env.difficulty.tolist() == [0.0, 0.25, 1.0]
    for _ in range(2):
        env.step(np.zeros((3, 4)))
    assert env.scene(0) != RING
    assert (env.state().goal_radius == 0.0).all()


def test_options_of_a_partial_reset_are_those_of_its_robots():
    env = SnakeVectorEnv(2, task="field", autoreset_mode="Disabled")
    env.reset(seed=0)
    before = env.scene(0)
    env.reset(options={"reset_mask": np.array([False, True]), "scene": RING, "start": BESIDE})
    assert (env.scene(0), env.scene(1).obstacles) == (before, RING.obstacles)
    assert env.state().link_position[1, 0].tolist() == pytest.approx([0.6, 5.0])


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"scene": 3}, "scene"),
        ({"scene": []}, "scene"),
        ({"scene": lambda rng, difficulty: None}, "scene"),
        ({"scene": [Scene(), Scene(friction=(0.3, 0.3))]}, "scene"),
        ({"scene": Scene(obstacles=[(0.1, 0.0, 0.0)])}, r"scene\.obstacles\[0\]"),
        ({"scene": Scene(), "friction": (0.2, 0.2)}, "friction"),
        ({"scene": Scene(), "slope": (0.1, 0.0)}, "slope"),
        ({"scene": Scene(), "start": Start(pitch=0.5)}, r"start\.pitch"),
        ({"start": Start(posture=[0.1])}, r"start\.posture"),
        ({"goal": "there"}, "goal"),
        ({"goal": (1.0, "there")}, "goal"),
        ({"goal": ("3", "1")}, "goal"),
        ({"goal": (True, False)}, "goal"),
        ({"goal": (True, 0.5)}, "goal"),
        ({"goal": [(0.0, 0.0), ("1", 0.0)]}, r"goal\[1\]"),
        ({"corridor": ("0", "0.5")}, "corridor"),
        ({"corridor": (0.0, True)}, "corridor"),
        ({"goal": np.array("there")}, "goal"),
        ({"goal": [(0.0, 0.0), (1.0,)]}, r"goal\[1\]"),
        ({"goal": -1.0}, r"goal\.distance"),
        ({"goal": (1.0, 0.0, -1.0)}, r"goal\.radius"),
        ({"goal": (0.0, 5.0), "start": BESIDE}, "goal"),
        ({"corridor": 3}, "corridor"),
        ({"observation_blocks": ["joint_angle", "smell"]}, r"observation_blocks\[1\]"),
        ({"observation_blocks": []}, "observation_blocks"),
        ({"termination": {"is_succes": True}}, r"termination\.is_succes"),
        ({"observation": "image"}, "observation"),
        ({"termination_fn": 1}, "termination_fn"),
    ],
)
def test_what_does_not_fit_is_named(options, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        reset_often(options)


def reset_often(options):
    """A list of scenes is drawn from."""
    env = SnakeVectorEnv(2, task="field", **options)
    for seed in range(20):
        env.reset(seed=seed)


BLOCKED = Scene(obstacles=[(0.1, 0.0, 0.0)])


@pytest.mark.parametrize(
    "options",
    [
        {"difficulty": 0.9, "scene": [RING, BLOCKED]},
        {"difficulty": [0.9, 7.0], "scene": RING},
        {"difficulty": 0.9, "goal": [2.0, "there"]},
        {"scene": [RING, 3]},
    ],
)
def test_a_refused_reset_changes_nothing(options):
    """Neither difficulties nor the world of the robots that were not the culprit, nor the random numbers to come."""
    env, same = (SnakeVectorEnv(2, task="field", scene=drawn) for _ in range(2))
    env.reset(seed=3)
    same.reset(seed=3)
    for seed in (None, 8, [8, None]):
        with pytest.raises(ConfigError):
            env.reset(seed=seed, options=options)
    assert env.difficulty.tolist() == [0.5, 0.5]
    assert_identical(env.state().arrays(), same.state().arrays(), "after refused resets")
    assert_identical(env.step(np.zeros((2, 4))), same.step(np.zeros((2, 4))), "the next step")
    assert_identical(env.reset(), same.reset(), "the next reset")
    assert [env.scene(i) for i in range(2)] == [same.scene(i) for i in range(2)]


def test_a_refused_first_reset_draws_no_seeds():
    env, same = (SnakeVectorEnv(2, task="field") for _ in range(2))
    for one in (env, same):
        one.np_random = np.random.default_rng(5)
    with pytest.raises(ConfigError):
        env.reset(options={"scene": BLOCKED})
    assert_identical(env.reset(), same.reset(), "the first reset")


def test_a_list_for_robots_has_one_entry_each():
    env = SnakeVectorEnv(3, task="field")
    with pytest.raises(ConfigError, match=r"^options\['scene'\] = a list of 2: expected a list of 3"):
        env.reset(options={"scene": [RING, RING]})


CORNER = [(0.0, 0.0), (1.0, 0.0), (1.0, 2.0)]


@pytest.mark.parametrize("path", [CORNER, tuple(CORNER), np.array(CORNER), {"path": CORNER}])
def test_a_path_is_a_goal(path):
    env = SnakeEnv(task="free", goal=path, start_jitter=0.0)
    env.reset(seed=0)
    state = env.state()
    np.testing.assert_array_equal(state.goal, [1.0, 2.0])
    ahead = np.array([0.5, 0.0]) - state.position
    assert state.goal_direction == pytest.approx(np.arctan2(ahead[1], ahead[0]), abs=0.01)


def test_a_robot_that_leaves_its_path_has_left_the_corridor():
    """The gait goes on along +x, where the path turns."""
    env = SnakeEnv(task="free", goal=CORNER, corridor_half_width=0.3, start_jitter=0.0, max_episode_steps=400)
    env.reset(seed=0)
    info = {"left_corridor": False}
    while not info["left_corridor"]:
        _, _, terminated, truncated, info = env.step(np.array([0.0, 1.0, 0.0, 0.0]))
        assert not truncated
    assert terminated
    assert env.state().position[0] > 1.25


def test_the_end_of_a_path_is_success():
    env = SnakeEnv(task="free", goal=[(0.0, 0.0), (0.7, 0.0)], start_jitter=0.0)
    env.reset(seed=0)
    terminated = False
    while not terminated:
        _, _, terminated, truncated, info = env.step(np.array([0.0, 1.0, 0.0, 0.0]))
        assert not truncated
    assert info["is_success"]
    assert env.state().position[0] == pytest.approx(0.45, abs=0.05)


def test_commands_differ_from_robot_to_robot():
    envs = SnakeVectorEnv(3, task="command")
    goals = [{"heading": 0.5, "speed": 0.1}, {"path": CORNER, "speed": 0.05}, {"speed": 0.0}]
    envs.reset(seed=0, options={"goal": goals})
    np.testing.assert_array_equal(envs.state().goal_speed, [0.1, 0.05, 0.0])
    assert envs.state().goal_direction[0] == 0.5
    envs.reset()
    assert ((envs.state().goal_speed >= 0.05) & (envs.state().goal_speed < 0.2)).all()


@pytest.mark.parametrize(
    ("task", "goal", "field"),
    [
        ("free", [(0.0, 0.0), (0.0, 0.0)], r"goal\.path\[1\]"),
        ("free", {"path": [(0.0, 0.0)]}, r"goal\.path"),
        ("free", [(-1.0, 0.0), (0.0, 0.0)], "goal"),
        ("free", {"heading": 0.1, "point": (1.0, 1.0)}, "goal"),
        ("free", {"heading": float("nan")}, r"goal\.heading"),
        ("free", {"distance": 1.0, "speed": 0.1}, r"goal\.speed"),
        ("command", {"speed": -0.1}, r"goal\.speed"),
    ],
)
def test_a_goal_that_is_none_is_refused_by_name(task, goal, field):
    with pytest.raises(ConfigError, match=field):
        SnakeEnv(task=task, goal=goal)


@pytest.mark.parametrize("goal", [[2.0, 1.0], [2.0, 1.0, 0.3], CORNER, (2.0, 1.0), 3.0])
def test_one_environment_takes_at_a_reset_what_it_takes_as_a_keyword(goal):
    own, told = SnakeEnv(task="field", goal=goal), SnakeEnv(task="field")
    own.reset(seed=0)
    told.reset(seed=0, options={"goal": goal, "start": None})
    assert_identical(own.state().arrays(), told.state().arrays(), "the goal of a reset")


def test_one_environment_draws_a_scene_at_a_reset_as_it_does_from_its_keyword():
    ground = (0.2, 0.2)
    for scene in ([RING, Scene(obstacles=FAR.obstacles, friction=ground)], lambda rng, difficulty: RING):
        own, told = SnakeEnv(task="field", scene=scene), SnakeEnv(task="field", friction=ground)
        for seed in range(4):
            own.reset(seed=seed)
            told.reset(seed=seed, options={"scene": scene})
            assert own.scene().obstacles == told.scene().obstacles


def test_in_a_batch_a_list_of_numbers_is_one_goal_line_per_robot():
    """A point is a tuple or an array there."""
    env = SnakeVectorEnv(2, task="field")
    env.reset(seed=0, options={"goal": [3.0, 1.0]})
    lines = env.state().goal
    env.reset(seed=0, options={"goal": (3.0, 1.0)})
    np.testing.assert_allclose(lines[:, 0], [3.0, 1.0], atol=0.1)  # from the start, which is drawn
    assert env.state().goal.tolist() == [[3.0, 1.0]] * 2
    with pytest.raises(ConfigError, match="a point is a tuple"):
        SnakeVectorEnv(4, task="field").reset(options={"goal": [3.0, 1.0]})


@pytest.mark.parametrize("difficulty", [[[0.1], [0.2, 0.3]], "0.5", [True, False], [0.5, None]])
def test_a_difficulty_of_a_reset_that_is_none_is_named(difficulty):
    with pytest.raises(ConfigError, match=r"^difficulty = "):
        SnakeVectorEnv(2, task="field").reset(seed=0, options={"difficulty": difficulty})


def test_a_scene_is_converted_once_for_all_robots_and_episodes(tmp_path):
    """A reset among thousands of boxes costs a robot little more than one on open ground."""
    crowd = Scene(obstacles=[Box((0.05, 0.05), 3.0 + 0.2 * (k % 200), 0.2 * (k // 200)) for k in range(4000)])
    path = tmp_path / "crowd.json"
    crowd.save(path)

    def seconds(envs, options=None):
        envs.reset(seed=0, options=options)
        begin = time.process_time()
        envs.reset(seed=1, options=options)
        return time.process_time() - begin

    envs = gym.make_vec("SnakeField-v1", num_envs=50, scene=crowd, num_threads=1)
    once = -time.process_time()
    Scene(obstacles=crowd.obstacles)
    once += time.process_time()
    assert seconds(envs) < 0.2 * once
    # Nor is it converted for each robot where the options of a reset name a file.
    assert seconds(envs, {"scene": path}) < 20 * once


def test_robots_that_share_a_scene_are_those_that_have_one_each():
    crowd = [(0.03, 1.0 + 0.3 * (k % 10), 0.3 * (k // 10) - 1.0) for k in range(70)] + [Box((0.1, 0.1), 2.5, 1.2)]
    shared = SnakeVectorEnv(num_envs=3, scene=Scene(obstacles=crowd))
    own = SnakeVectorEnv(num_envs=3, scene=Scene(obstacles=[]))
    told = {"scene": [Scene(obstacles=crowd) for _ in range(3)]}
    rng = np.random.default_rng(0)
    for seed in range(2):
        assert_identical(shared.reset(seed=seed), own.reset(seed=seed, options=told), f"reset {seed}")
        for k in range(20):
            actions = rng.uniform(-1.0, 1.0, shared.action_space.shape)
            assert_identical(shared.step(actions), own.step(actions), f"step {k}")
    # A robot that leaves the scene changes nothing for the others.
    shared.reset(options={"reset_mask": np.array([True, False, False]), "scene": Scene(obstacles=[(0.1, 4.0, 0.0)])})
    assert [len(shared.scene(i).obstacles) for i in range(3)] == [1, 71, 71]
    shared.set_state(own.get_state())
    assert [len(shared.scene(i).obstacles) for i in range(3)] == [71, 71, 71]


def test_a_scene_that_is_gone_is_not_taken_for_another():
    """Python gives a new object the address of one that is gone."""
    envs = SnakeVectorEnv(num_envs=1, scene=FAR)
    for k in range(50):
        envs.reset(seed=0, options={"scene": Scene(obstacles=[(0.1, 3.0 + k, 0.0)], friction=(0.2, 0.5))})
        assert envs.scene(0).obstacles == ((0.1, 3.0 + k, 0.0),)
