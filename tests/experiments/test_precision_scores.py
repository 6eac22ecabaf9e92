"""Scores of policies at every precision."""

import numpy as np
import pytest

from experiments.precision_scores import changed, main


def test_changes_are_those_of_the_scenes_that_both_reach() -> None:
    fine = {
        "is_success": np.array([True, True, True, False]),
        "speed": np.array([0.2, 0.4, 0.1, 9.0]),
        "energy": np.array([10.0, 20.0, 90.0, 500.0]),
        "distance": np.array([1.0, 2.0, 1.0, 1.0]),
    }
    other = fine | {"is_success": np.array([True, True, False, True]), "speed": 1.1 * fine["speed"]}
    other["energy"] = 0.8 * fine["energy"]
    speed, cost = changed(other, fine)
    assert speed == pytest.approx((10.0, 10.0, 10.0))
    assert cost == pytest.approx((-20.0, -20.0, -20.0))


def test_every_precision_has_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--scenes", "2", "--policies", "corridor"]) == 0
    rows = [line.split("|")[3].strip() for line in capsys.readouterr().out.splitlines() if line.startswith("| `")]
    assert rows == ["fast", "default", "fine"]
