"""Pictures, drawn without a display."""

from __future__ import annotations

import warnings

import gymnasium as gym
import numpy as np
import pytest
from conftest import run_python

pytest.importorskip("pygame")

from snake_env import SnakeEnv, SnakeVectorEnv
from snake_env.rendering import BODY, FORCE, GOAL, HEAD, PEG, SIZE, caption


def colours(image):
    """Colours of a picture."""
    return {tuple(colour) for colour in image.reshape(-1, 3)}


def test_a_picture_shows_robot_pegs_and_contact_forces():
    env = gym.make("SnakeCourse-v0", render_mode="rgb_array")
    env.reset(seed=0)
    for _ in range(40):
        env.step(np.zeros(4))
    image = env.render()
    assert (image.shape, image.dtype) == ((SIZE[1], SIZE[0], 3), np.uint8)
    assert {HEAD, *BODY, PEG, FORCE} <= colours(image)


def test_a_robot_in_space_is_seen_from_above_and_from_the_side():
    env = gym.make("SnakeSpatial-v0", render_mode="rgb_array", goal_distance=0.4)
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
    text = caption({"time": 1.5, "distance": distance, "speed": -0.001})
    assert text.split() == f"t = 1.50 s distance {shown} m speed 0.00 m/s".split()


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
