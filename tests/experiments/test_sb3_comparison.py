"""Lean against Stable-Baselines3: the same steps, the same fields, a rate each."""

import json

import pytest

pytest.importorskip("stable_baselines3")

from experiments import sb3_comparison


def test_all_learners_take_the_same_steps_and_are_judged_alike(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sb3_comparison, "FIELDS", 2)
    out = tmp_path / "learners.json"
    assert sb3_comparison.main(["--config", "smoke", "--steps", "512", "--repetitions", "2", "--out", str(out)]) == 0
    found = json.loads(out.read_text())
    assert {name: len(rows) for name, rows in found["runs"].items()} == dict.fromkeys(sb3_comparison.LEARNERS, 2)
    rates = {name: found["median"][name]["steps per CPU second"] for name in sb3_comparison.LEARNERS}
    lean = {name: rate / rates["SB3"] for name, rate in rates.items() if name != "SB3"}
    assert found["ratios"] == pytest.approx(lean)
    assert "times the steps per CPU second" in capsys.readouterr().out
