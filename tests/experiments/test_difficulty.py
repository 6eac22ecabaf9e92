"""How hard the tasks are."""

from __future__ import annotations

from dataclasses import replace

from experiments import difficulty
from snake_env.evaluation.statistics import Estimate


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
    args = difficulty.Options(difficulties=(0.5,), fields=2, num_threads=1)
    for task in difficulty.FAMILIES.values():
        short = replace(task, options={**task.options, "max_episode_steps": 20})
        (found,) = difficulty.measure("gait", short, args)
        assert 0.0 <= found.low <= found.value <= found.high <= 1.0


def test_a_level_is_reached_only_after_all_easier_ones():
    curve = [Estimate(value, value, value) for value in (0.9, 0.8, 0.7, 0.95)]
    assert difficulty.level(curve, (0.0, 0.25, 0.5, 1.0)) == "0.25"
    assert difficulty.level(curve[2:], (0.0, 0.25)) == "-"
    assert difficulty.level(curve[::-1], (1.0, 0.5, 0.25, 0.0)) == "0.25"
