"""The comparison with an earlier build."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from experiments import earlier_commit
from snake_env import ConfigError

SOURCES = shutil.ignore_patterns("__pycache__")


@pytest.fixture
def other(tmp_path: Path) -> Path:
    """A folder with a build of its own, of an early commit that had no corridors."""
    shutil.copytree(earlier_commit.ROOT / "snake_env", tmp_path / "snake_env", ignore=SOURCES)
    ids = (tmp_path / "snake_env" / "__init__.py").open("a")
    with ids:
        ids.write('\n\nimport gymnasium\n\ndel gymnasium.registry["SnakeCorridor-v1"]\n')
    return tmp_path


def test_every_batch_that_both_have_is_stepped_by_both(
    other: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    trees = {"old": other, "HEAD": earlier_commit.ROOT}
    monkeypatch.setattr(earlier_commit, "built", lambda field, commit, builds: trees[commit])
    batch = ["--envs", "SnakeFree", "SnakeCorridor", "--robots", "4", "--turns", "2", "--periods", "2"]
    assert earlier_commit.main(["old", *batch]) == 0
    head, _, *rows = capsys.readouterr().out.splitlines()
    assert head.startswith("| environment | mode | actions |")
    cells = [[cell.strip() for cell in line.split("|")[1:7]] for line in rows]
    assert [each[:3] for each in cells] == [
        ["SnakeFree-v1", *kind] for kind in (["gait", "zero"], ["gait", "random"], ["joints", "random"])
    ]
    assert all(float(cell.replace(",", "")) > 0.0 for each in cells for cell in each[3:])
    rough = ["--envs", "SnakeCourse", "--peg-friction", "0.3", "--modes", "joints", *batch[3:]]
    assert earlier_commit.main(["old", *rough]) == 0
    assert "SnakeCourse-v1" in capsys.readouterr().out


def test_the_ratio_is_that_of_times_of_the_same_turn() -> None:
    times = np.array([[4e-5, 2e-5], [4e-4, 2e-4], [6e-5, 2e-5]])
    cells = earlier_commit.row(("SnakeFree-v1", "gait", "zero", 8, 0.0), times)
    assert cells == ("SnakeFree-v1", "gait", "zero", "16,667", "50,000", "2.00", "2.00 to 2.50")


def test_an_unknown_commit_is_one_clear_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert earlier_commit.main(["no-such-commit"]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert "no-such-commit" in line


def test_a_commit_that_does_not_compile_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUSTC", "/no/such/compiler")
    for _ in range(2):
        with pytest.raises(ConfigError, match="can be built"):
            earlier_commit.built("commit", "HEAD", tmp_path)


def test_a_process_that_has_another_snake_env_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(f"import sys\n\nsys.path.insert(0, {str(earlier_commit.ROOT)!r})\n")
    with pytest.raises(RuntimeError, match="has the snake_env of"):
        earlier_commit.Timer(tmp_path)


def test_a_process_that_ends_is_reported(other: Path) -> None:
    timer = earlier_commit.Timer(other)
    with pytest.raises(RuntimeError, match="ended"):
        timer.request("not a request")
    timer.stop()
