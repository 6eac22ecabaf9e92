"""The table of errors and bias under random actions."""

import numpy as np
import pytest

from experiments import random_action_errors
from experiments.random_action_errors import Options, Run


def test_finer_precisions_err_less_and_cost_more(capsys: pytest.CaptureFixture[str]) -> None:
    batch = ["--tasks", "course", "--modes", "gait", "--num-envs", "16", "--periods", "10"]
    assert random_action_errors.main([*batch, "--precisions", "fast", "fine"]) == 0
    *lines, blank, place = capsys.readouterr().out.splitlines()
    head, _, *rows = lines
    assert not blank
    assert place.startswith("On one core of ")
    assert head.startswith("| scene | actions | precision |")
    fast, fine = ([float(cell) for cell in line.split("|")[4:9]] for line in rows)
    assert fine[0] > fast[0], "linear solves"
    assert all(fine[column] < 0.5 * fast[column] for column in (2, 3)), "errors"


@pytest.mark.parametrize("task", ["field", "open", "spatial-open"])
def test_work_at_the_default_precision_has_no_bias(task: str) -> None:
    """Over a second of random actions: 2 % at most, where Euler parts of 6 ms take a sixth of the work of a field."""
    args = Options(num_envs=48)
    reference = random_action_errors.finely(task, "joints", args)
    run = random_action_errors.simulate(task, "joints", args)
    both = ~(run.ended | reference.ended)
    assert abs(run.work[both].sum() / reference.work[both].sum() - 1.0) < 0.02
    *_, bias = random_action_errors.row(task, "joints", "default", run, reference)
    assert abs(float(bias.split()[0])) < 2.0


def test_ended_episodes_do_not_count() -> None:
    position = np.zeros((2, 3, 11, 2))
    moved = position.copy()
    moved[1, 0, 5, 0] = 1.0
    moved[0, 2, 10, 1] = 2.0
    work = np.array([1.0, 5.0, 7.0])
    run = Run(moved, np.array([1.1, 9.0, 9.0]), np.array([False, False, True]), 1.0, 1.0)
    reference = Run(position, work, np.array([False, True, False]), 1.0, 1.0)
    *_, first, last, largest, bias = random_action_errors.row("course", "gait", "fine", run, reference)
    assert (first, last, largest, bias) == ("0.00", "1000.00", "1000.00", "+10.0 (0.0)")
