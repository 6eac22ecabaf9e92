"""Pictures, drawn without a display."""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from conftest import run_python

pytest.importorskip("pygame")

import pygame

import snake_env
from snake_env import ConfigError, Picture, Scene, SnakeEnv, SnakeVectorEnv, Start, palette
from snake_env.obstacles import Box
from snake_env.palette import BODY, FORCE, GOAL, GRID, GROUND, HEAD, LONGEST_ARROW, MARK, PEG
from snake_env.rendering import CAPTION, LOW, TopView, Window, caption, shade

SIZE = Picture().size
SHOWN_SIDE = -1.0
"""Sign of the roll with which the back of a robot is seen in the strip."""


def colours(image):
    """Colours of a picture."""
    return {tuple(colour) for colour in image.reshape(-1, 3)}


def test_a_picture_shows_robot_pegs_and_contact_forces():
    env = gym.make("SnakeCourse-v1", render_mode="rgb_array")
    env.reset(seed=0)
    for _ in range(40):
        env.step(np.zeros(4))
    image = env.render()
    assert (image.shape, image.dtype) == ((SIZE[1], SIZE[0], 3), np.uint8)
    assert {HEAD, *BODY, PEG, FORCE} <= colours(image)


def test_a_robot_in_space_is_seen_from_above_and_from_the_side():
    env = gym.make("SnakeSpatial-v1", render_mode="rgb_array", goal_distance=0.4)
    env.reset(seed=0)
    flat = env.render()
    for _ in range(40):
        env.step(np.zeros(6))
    image = env.render()
    above, side = image[: SIZE[1]], image[SIZE[1] :]
    assert {HEAD, *BODY, GOAL} <= colours(above)
    assert {HEAD, *BODY, FORCE} <= colours(side)
    # Sidewinding lifts: the links reach higher than those of the robot that rests.
    assert top_row(side) < top_row(flat[SIZE[1] :]) - 5


@pytest.mark.parametrize(("roll", "is_seen"), [(0.0, True), (np.pi, False)])
def test_the_mark_on_the_back_shows_how_a_robot_rolls(roll, is_seen):
    start = Start(posture="straight", roll=roll)
    env = gym.make("SnakeSpatial-v1", render_mode="rgb_array", start=start)
    env.reset(seed=0)
    assert (MARK in colours(env.render()[: SIZE[1]])) == is_seen


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_robot_on_its_side_shows_its_mark_to_one_side(side):
    start = Start(posture="straight", roll=side * np.pi / 2)
    env = gym.make("SnakeSpatial-v1", render_mode="rgb_array", start=start)
    env.reset(seed=0)
    assert (MARK in colours(env.render()[SIZE[1] :])) == (side == SHOWN_SIDE)


def test_pegs_beside_a_robot_in_space_are_seen_from_the_side():
    scene = Scene(obstacles=[(0.05, 0.4, 0.2), (0.05, -0.4, 2.0)])
    start = Start(position=(0.0, 0.0), heading=np.pi, posture="straight")
    env = gym.make("SnakeSpatial-v1", render_mode="rgb_array", task="field", scene=scene, start=start)
    env.reset(seed=0)
    columns = np.flatnonzero((env.render()[SIZE[1]] == LOW).all(axis=1))
    assert len(columns) == pytest.approx(0.1 * 800 / 2.8, abs=3), "one of them"


def test_arrows_of_large_forces_end_within_their_limit():
    env = gym.make("SnakeCourse-v1", render_mode="rgb_array", picture={"layers": ("forces",), "force_scale": 1.0})
    env.reset(seed=0)
    for _ in range(40):
        env.step(np.zeros(4))
    state = env.unwrapped.state()
    rows, columns = np.nonzero((env.render() == FORCE).all(axis=2))
    pixels = np.hypot(columns - SIZE[0] / 2, rows - SIZE[1] / 2).max()
    body = np.linalg.norm(state.link_position - state.position, axis=1).max()
    assert np.linalg.norm(state.contact_force, axis=1).max() > 2.0
    assert pixels * 2.8 / 800 < body + LONGEST_ARROW + 0.02


@pytest.mark.parametrize("scale", [0.01, 0.001])
def test_the_caption_has_the_scale_of_the_forces(scale):
    env = gym.make("SnakeCourse-v1", render_mode="rgb_array", picture={"force_scale": scale})
    env.reset(seed=0)
    strip = env.render()[:36]
    length = np.ptp(np.nonzero((strip == FORCE).all(axis=2).any(axis=0))[0])
    newtons = {0.01: 20, 0.001: 200}[scale]
    assert length == pytest.approx(newtons * scale * 800 / 2.8, abs=2)


def test_the_playground_has_the_same_look():
    """It imports what the palette writes as a program, without the package."""
    written = subprocess.run([sys.executable, palette.__file__], capture_output=True, text=True, check=True).stdout
    exported = dict(re.findall(r"export const (\w+) = (.*);", written))
    for name in ("HEAD", "FORCE", "SPRING"):
        assert int(exported[name], 16).to_bytes(3, "big") == bytes(getattr(palette, name))
    assert float(exported["FORCE_SCALE"]) == palette.FORCE_SCALE
    page = (Path(__file__).parents[2] / "rust/playground/web/view.js").read_text(encoding="utf-8")
    assert set(re.search(r"import {(.*)} from \"./palette.js\"", page)[1].replace(" ", "").split(",")) == set(exported)


@pytest.mark.parametrize("height", [0.2, 0.6, 1.5])
def test_a_raised_robot_is_in_the_view_from_the_side(height):
    start = Start(position=(0.0, 0.0, height), posture="straight")
    env = gym.make("SnakeSpatial-v1", render_mode="rgb_array", start=start)
    env.reset(seed=0)
    side = env.render()[SIZE[1] :]
    assert HEAD in colours(side)
    assert top_row(side) > 1


def test_a_high_step_is_in_the_view_from_the_side():
    scene = Scene(obstacles=[Box((0.4, 2.0), 0.4, 0.0, height=0.5)])
    start = Start(position=(0.0, 0.0), heading=np.pi, posture="straight")
    env = gym.make("SnakeSpatial-v1", render_mode="rgb_array", scene=scene, start=start)
    env.reset(seed=0)
    side = env.render()[SIZE[1] :]
    rows = np.flatnonzero((side == shade(0.5)).all(axis=2).any(axis=1))
    assert len(rows) > 10
    assert rows[0] > 1


def top_row(image):
    """The highest row with a pixel of the body."""
    return int(np.flatnonzero((image == BODY[0]).all(axis=2).any(axis=1))[0])


def test_the_goal_comes_into_view():
    env = SnakeEnv(task="free", render_mode="rgb_array", goal_distance=0.5)
    env.reset(seed=0)
    assert GOAL in colours(env.render())


def test_the_picture_follows_the_state():
    env = SnakeEnv(task="free", render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    np.testing.assert_array_equal(env.render(), first)
    for _ in range(5):
        env.step(np.ones(4))
    assert not np.array_equal(env.render(), first)


@pytest.mark.parametrize(("distance", "shown"), [(-0.004, "0.00"), (0.0, "0.00"), (-0.006, "-0.01"), (1.25, "1.25")])
def test_a_caption_has_no_negative_zero(distance, shown):
    assert caption(1.5, distance).startswith(f"t = 1.50 s    distance {shown} m    speed ")
    assert "-0.00" not in caption(1.5, distance)


def test_the_batch_returns_a_tuple_of_pictures():
    env = SnakeVectorEnv(3, task="field", render_mode="rgb_array")
    env.reset(seed=0)
    frames = env.render()
    assert isinstance(frames, tuple)
    assert [frame.shape for frame in frames] == [(SIZE[1], SIZE[0], 3)] * 3
    assert not np.array_equal(frames[0], frames[1])


@pytest.mark.parametrize("kind", [SnakeEnv, SnakeVectorEnv])
def test_without_a_mode_render_warns(kind):
    env = kind(task="free")
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_the_window_opens_and_closes():
    """SDL's dummy driver stands in for a display."""
    env = SnakeEnv(task="free", render_mode="human", control_period=0.01)
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(4))
    assert env.render() is None
    env.close()
    env.close()


def test_pictures_survive_that_someone_else_closes_pygame():
    env = SnakeEnv(task="free", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    pygame.quit()
    np.testing.assert_array_equal(env.render(), before)


def test_the_window_opens_again_when_someone_else_closes_pygame():
    env = SnakeEnv(task="free", render_mode="human", control_period=0.01)
    env.reset(seed=0)
    pygame.quit()
    env.step(np.zeros(4))
    assert pygame.display.get_surface() is not None
    env.close()


def test_a_window_that_the_user_closes_stays_closed():
    env = SnakeEnv(task="free", render_mode="human", control_period=0.01)
    env.reset(seed=0)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    env.step(np.zeros(4))
    assert pygame.display.get_surface() is None
    env.step(np.zeros(4))
    assert pygame.display.get_surface() is None
    env.close()
    env.step(np.zeros(4))
    assert pygame.display.get_surface() is not None
    env.close()


def test_a_batch_draws_on_one_canvas_with_a_trail_for_each_robot(monkeypatch):
    canvases = []
    first = TopView.__init__
    monkeypatch.setattr(TopView, "__init__", lambda self, picture: (canvases.append(self), first(self, picture))[1])
    batch = SnakeVectorEnv(3, task="free", render_mode="rgb_array")
    batch.reset(seed=0)
    for _ in range(3):
        frames = batch.render()
        batch.step(np.ones((3, 4)))
    assert len(canvases) == 1
    single = SnakeEnv(task="free", render_mode="rgb_array")
    single.reset(seed=1)
    for _ in range(5):
        single.step(np.ones(4))
        single.render()
    single.reset(seed=2)
    for _ in range(3):
        frame = single.render()
        single.step(np.ones(4))
    np.testing.assert_array_equal(frames[2], frame)


def test_pictures_need_no_display_and_no_driver():
    code = """
        import os, sys
        for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
            os.environ.pop(name, None)
        import snake_env
        assert "pygame" not in sys.modules
        env = snake_env.SnakeEnv(task="field", render_mode="rgb_array")
        env.reset(seed=0)
        print(env.render().shape)
    """
    assert run_python(code) == "(480, 800, 3)"


def test_rendering_changes_nothing():
    plain, drawn = SnakeVectorEnv(2, task="field"), SnakeVectorEnv(2, task="field", render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for env in (plain, drawn):
            env.reset(seed=0)
        for k in range(5):
            drawn.render()
            actions = np.full((2, 4), 0.1 * k)
            np.testing.assert_array_equal(plain.step(actions)[0], drawn.step(actions)[0])


def drawn(picture, **options):
    env = SnakeEnv(render_mode="rgb_array", picture=picture, **{"task": "free", "start_jitter": 0.0} | options)
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.zeros(4))
    return env.render()


def body(image):
    """Rows and columns of the pixels of the leading link."""
    return np.argwhere((image == HEAD).all(axis=2))


def test_a_picture_has_the_size_and_the_layers_that_are_asked_for():
    image = drawn({"size": [320, 200], "layers": ["links"]})
    assert image.shape == (200, 320, 3)
    assert HEAD in colours(image)
    assert not {*GRID, CAPTION, GOAL} & colours(image)


def test_zoom_enlarges():
    def width(zoom):
        image = drawn(Picture(zoom=zoom, layers=("links",)))
        return np.ptp(np.argwhere((image != GROUND).any(axis=2))[:, 1])

    assert width(1.0) / width(0.5) == pytest.approx(2.0, rel=0.02)


def test_a_fixed_camera_sees_the_robot_move():
    env = SnakeEnv(task="free", render_mode="rgb_array", picture=Picture(camera="fixed"))
    env.reset(seed=0)
    before = body(env.render()).mean(axis=0)
    for _ in range(60):
        env.step(np.zeros(4))
    assert body(env.render()).mean(axis=0)[1] - before[1] > 20.0
    env.reset(seed=0)
    np.testing.assert_allclose(body(env.render()).mean(axis=0), before)
    away = drawn(Picture(camera="fixed", centre=(50.0, 0.0), layers=("links",)))
    assert HEAD not in colours(away)


def test_the_whole_scene_fits_into_a_picture():
    scene = Scene(obstacles=[(0.2, 9.0, 4.0), (0.2, -3.0, -5.0)])
    image = drawn(Picture(camera="scene", layers=("obstacles", "goal", "links")), scene=scene, goal=(8.0, -2.0, 0.4))
    assert {PEG, HEAD, GOAL} <= colours(image)
    pegs = np.argwhere((image == PEG).all(axis=2))
    spread = np.ptp(pegs, axis=0)
    # 12 m by 9 m between the centres, to one scale.
    assert spread[1] / spread[0] == pytest.approx(12.4 / 9.4, rel=0.03)


def test_a_commanded_direction_is_an_arrow():
    image = drawn(None, task="command", goal={"heading": 0.5 * np.pi, "speed": 0.1})
    arrow = np.argwhere((image == GOAL).all(axis=2))
    assert arrow[:, 0].min() < SIZE[1] / 2 - 100


@pytest.mark.parametrize(
    ("picture", "field"),
    [
        ({"size": (10, 480)}, r"picture\.size\[0\]"),
        ({"size": 3}, r"picture\.size"),
        ({"camera": "drone"}, r"picture\.camera"),
        ({"centre": (0.0, float("nan"))}, r"picture\.centre\[1\]"),
        ({"zoom": 0.0}, r"picture\.zoom"),
        ({"layers": ["sky"]}, r"picture\.layers\[0\]"),
        ({"colour": "red"}, r"picture\.colour"),
        (7, "picture"),
    ],
)
def test_a_picture_is_refused_by_field(picture, field):
    with pytest.raises(ConfigError, match=field):
        SnakeEnv(task="free", picture=picture)


def test_keys_zoom_and_close_the_window():
    env = SnakeEnv(task="free", render_mode="human", control_period=0.01)
    env.reset(seed=0)

    def press(key):
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))
        env.step(np.zeros(4))

    before = len(body(np.transpose(pygame.surfarray.array3d(pygame.display.get_surface()), (1, 0, 2))))
    press(pygame.K_PLUS)
    env.step(np.zeros(4))
    after = len(body(np.transpose(pygame.surfarray.array3d(pygame.display.get_surface()), (1, 0, 2))))
    assert after / before == pytest.approx(1.25**2, rel=0.1)
    press(pygame.K_ESCAPE)
    assert pygame.display.get_surface() is None
    env.close()


@pytest.mark.parametrize("num_envs", [1, 5])
def test_the_window_of_a_batch_is_drawn_once_however_it_is_asked(num_envs, monkeypatch):
    drawn, show = [], Window.show
    monkeypatch.setattr(Window, "show", lambda *args: (drawn.append(1), show(*args)))
    envs = SnakeVectorEnv(num_envs, task="free", render_mode="human", control_period=0.01)
    envs.reset(seed=0)
    envs.step(np.zeros((num_envs, 4)))
    assert len(drawn) == 2
    for ask in (envs.render, lambda: envs.call("render"), lambda: [envs.render_robot(i) for i in range(num_envs)]):
        drawn.clear()
        ask()
        assert len(drawn) == 1
    envs.close()


def test_the_window_of_stable_baselines_is_drawn_once(monkeypatch):
    pytest.importorskip("stable_baselines3")
    drawn = []
    monkeypatch.setattr(Window, "show", lambda *args: drawn.append(1))
    venv = snake_env.sb3.make("SnakeFree-v1", 5, render_mode="human")
    venv.reset()
    drawn.clear()
    venv.render("human")
    assert len(drawn) == 1
    venv.close()


def test_a_path_is_drawn_along_its_corners():
    image = drawn(Picture(camera="scene", layers=("goal",)), goal=[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)])
    rows, columns = np.argwhere((image == GOAL).all(axis=2)).T
    # Two legs of equal length, to the right and then up.
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), rel=0.03)
