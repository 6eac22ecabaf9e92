"""The table of error control after CENIC; what it measures is tested in rust/bench/src/cenic.rs."""

from pathlib import Path

import numpy as np
import pytest

from experiments import cenic


def test_a_row_has_lengths_and_errors_against_the_reference_of_its_scene(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    still = np.zeros((2, 2, 11, 2))
    moved = still.copy()
    moved[:, 1, 3, 0] = 0.002
    common = {"scene": "field", "solves": 5.0, "lengths": [], "rejected": 0}
    records = [
        {**common, "stepping": "reference", "position": still.tolist(), "work": [1.0, 1.0]},
        {**common, "stepping": "fine", "position": still.tolist(), "work": [1.0, 1.0]},
        {**common, "stepping": "CENIC 1e-3", "position": moved.tolist(), "work": [0.9, 0.9]}
        | {"lengths": [0.01, 0.02, 0.03], "rejected": 1},
    ]
    monkeypatch.setattr(cenic.native, "build", lambda: Path("snake-bench"))
    monkeypatch.setattr(cenic.native, "measure", lambda program, arguments, progress: iter(records))
    assert cenic.main([]) == 0
    _, _, fine, controlled = (
        [cell.strip() for cell in line.split("|")[1:-1]] for line in capsys.readouterr().out.splitlines()
    )
    assert fine == ["field", "fine", "", "", "5.0", "0.00", "0.00", "0.00", "+0.0 (0.0)"]
    assert controlled == ["field", "CENIC 1e-3", "11.0, 20.0, 29.0", "25", "5.0", "0.00", "2.00", "2.00", "-10.0 (0.0)"]
