"""The table of errors under random actions."""

import numpy as np
import pytest

from experiments import random_action_errors


def test_finer_steps_err_less(capsys: pytest.CaptureFixture[str]) -> None:
    batch = ["--tasks", "course", "--modes", "gait", "--num-envs", "16", "--periods", "4"]
    assert random_action_errors.main([*batch, "--steps", "0.025", "0.005", "--reference", "0.001"]) == 0
    head, _, *rows = capsys.readouterr().out.splitlines()
    assert head.startswith("| task | actions |")
    coarse, fine = ([float(cell) for cell in line.split("|")[4:9]] for line in rows)
    assert fine[0] > coarse[0], "linear solves"
    assert fine[3] < coarse[3], "median of the largest errors"


def test_ended_episodes_do_not_count() -> None:
    position = np.zeros((2, 3, 11, 2))
    moved = position.copy()
    moved[1, 0, 5, 0] = 1.0
    moved[0, 2, 10, 1] = 2.0
    run = random_action_errors.Run(moved, np.array([False, False, True]), 1.0)
    reference = random_action_errors.Run(position, np.array([False, True, False]), 1.0)
    np.testing.assert_array_equal(random_action_errors.errors(run, reference), [[0.0], [1.0]])
