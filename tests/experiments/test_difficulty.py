"""Commands that tell how hard the tasks are."""

from __future__ import annotations

import numpy as np

from experiments import difficulty, open_loop_search


def test_success_of_the_gait_falls_with_difficulty(capsys, tmp_path):
    picture = tmp_path / "pictures" / "difficulty.png"
    command = ["--tasks", "perturbed", "--difficulties", "0", "1", "--fields", "12", "--num-threads", "1"]
    assert difficulty.main([*command, "--picture", str(picture)]) == 0
    row = capsys.readouterr().out.splitlines()[2]
    easy, hard = (float(cell.split()[0]) for cell in row.split("|")[2:4])
    assert easy == 1.0
    assert hard < 0.5
    assert picture.stat().st_size > 1000


def test_every_task_with_a_difficulty_is_measured():
    for options in difficulty.OPTIONS.values():
        curve = difficulty.measure({**options, "goal_distance": 0.3, "goal_radius": 0.2}, (0.5,), 2, 1)
        assert 0.0 <= curve[0].low <= curve[0].value <= curve[0].high <= 1.0


def test_a_script_is_found_where_almost_any_does(capsys, monkeypatch):
    monkeypatch.setattr(open_loop_search, "ROBOTS", 8)
    command = ["--env", "SnakeFree-v1", "--options", '{"goal_distance": 0.1}', "--starts", "2", "--rounds", "3"]
    assert open_loop_search.main(command) == 0
    assert "2 of 2 starts solved" in capsys.readouterr().out


def test_a_script_that_reaches_the_goal_beats_all_that_do_not():
    trial = open_loop_search.Trial(
        np.array([1.99, 2.0, 2.0]), np.array([False, True, True]), np.array([30.0, 9.0, 20.0])
    )
    assert np.argsort(-trial.score()).tolist() == [1, 2, 0]
