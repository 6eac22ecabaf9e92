"""Scores of how robots move: chatter of actions, progress without contact."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("scipy")

from snake_env.evaluation import BenchmarkTask, evaluate
from snake_env.evaluation.movement import Movement, chatter

PERIOD = 0.05


def sine(frequency, steps=400):
    return np.sin(2.0 * np.pi * frequency * PERIOD * np.arange(steps))[:, None].astype(np.float32)


def test_chatter_is_the_power_above_4_hz():
    assert chatter(sine(1.0), PERIOD) < 1e-3
    assert chatter(sine(6.0), PERIOD) > 0.999
    both = np.hstack([sine(1.0), 0.5 * sine(6.0)])
    assert chatter(both, PERIOD) == pytest.approx(0.2, abs=0.005), "power goes with the square"
    assert chatter(3.0 + sine(1.0), PERIOD) < 1e-3, "what is constant does not count"
    assert chatter(np.full((50, 4), 0.7, np.float32), PERIOD) == 0.0
    assert chatter(np.zeros((1, 4), np.float32), PERIOD) == 0.0


def test_progress_without_contact_is_that_of_the_steps_in_which_nothing_pushes():
    movement = Movement(3, PERIOD)
    action = np.zeros((3, 4), np.float32)
    running = np.array([True, True, False])
    movement.note(action, {"contacts": np.array([0, 2, 0]), "progress": np.array([0.3, 0.3, 0.3])}, running)
    movement.note(action, {"contacts": np.array([1, 0, 0]), "progress": np.array([0.2, -0.1, 0.3])}, running)
    np.testing.assert_allclose(movement.contact_free_progress, [0.3, -0.1, 0.0])


def test_actions_beyond_their_range_count_as_they_are_clipped():
    movement = Movement(1, PERIOD)
    infos = {"contacts": np.ones(1), "progress": np.zeros(1)}
    for action in (1.0, 2.0) * 50:
        movement.note(np.full((1, 1), action, np.float32), infos, np.ones(1, np.bool_))
    assert movement.chatter(0) == 0.0


def wave(phase):
    """Actions that change every second or every tenth step."""
    count = 0

    def act(observation):
        nonlocal count
        count += 1
        return np.tile(np.float32([0.0, 1.0, 0.0, 0.2 * (-1) ** (count // phase)]), (len(observation), 1))

    return act


def test_an_evaluation_has_both():
    open_ground = BenchmarkTask("open", "SnakeFree-v1", {"goal": 1.0})
    found = evaluate(wave(1), open_ground, scenes=2)
    assert found.scores["contact_free"].value == pytest.approx(1.0, abs=0.02), "there is nothing to touch"
    assert found.scores["chatter"].value > 0.99
    assert evaluate(wave(20), open_ground, scenes=2).scores["chatter"].value < 0.1
    course = evaluate(wave(20), "course", scenes=2)
    assert course.scores["contact_free"].value < 0.5, "pegs push the robot ahead"
