"""The comparison with an earlier build."""

import numpy as np
import pytest

from experiments import earlier_commit


def test_both_builds_step_every_batch(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(earlier_commit, "built", lambda commit, builds: earlier_commit.ROOT)
    batch = ["--envs", "SnakeFree", "--modes", "gait", "joints", "--robots", "4", "--turns", "2", "--periods", "2"]
    assert earlier_commit.main(["HEAD", *batch]) == 0
    head, _, *rows = capsys.readouterr().out.splitlines()
    assert head.startswith("| environment | mode | actions |")
    cells = [[cell.strip() for cell in line.split("|")[2:7]] for line in rows]
    assert [each[:2] for each in cells] == [["gait", "zero"], ["gait", "random"], ["joints", "random"]]
    assert all(float(cell.replace(",", "")) > 0.0 for each in cells for cell in each[2:])


def test_the_ratio_is_that_of_times_of_the_same_turn() -> None:
    taken = np.array([[4e-5, 2e-5], [4e-4, 2e-4], [6e-5, 2e-5]])
    cells = earlier_commit.row(("SnakeFree-v1", "gait", "zero", 8), taken)
    assert cells == ("SnakeFree-v1", "gait", "zero", "16,667", "50,000", "2.00", "2.00 to 2.50")


def test_an_unknown_commit_is_one_clear_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert earlier_commit.main(["no-such-commit"]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert "no-such-commit" in line


def test_a_process_that_dies_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(earlier_commit, "TIMER", "no_such_file.py")
    timer = earlier_commit.Timer(earlier_commit.ROOT)
    with pytest.raises((RuntimeError, BrokenPipeError)):
        timer.ask(["SnakeFree-v1", "gait", "zero", 1])
    timer.process.communicate()
