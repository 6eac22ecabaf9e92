"""How hard the tasks are."""

from __future__ import annotations

from experiments import difficulty


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
