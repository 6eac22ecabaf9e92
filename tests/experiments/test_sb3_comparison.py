"""Lean against Stable-Baselines3: the same steps, the same fields, a rate each."""

import json
import statistics

import pytest

pytest.importorskip("stable_baselines3")

from experiments import sb3_comparison


def test_all_learners_take_the_same_steps_and_are_judged_alike(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sb3_comparison, "FIELDS", 2)
    arguments = ["--config", "smoke", "--steps", "512", "--out", str(tmp_path)]
    assert sb3_comparison.main([*arguments, "--repetitions", "2"]) == 0
    found = json.loads((tmp_path / "sb3-comparison.json").read_text())
    assert {name: len(rows) for name, rows in found["runs"].items()} == dict.fromkeys(sb3_comparison.LEARNERS, 2)
    ours, theirs = ([row["steps per CPU second"] for row in found["runs"][name]] for name in ("ppo", "SB3"))
    ratio = statistics.median(one / other for one, other in zip(ours, theirs, strict=True))
    assert f"ppo against SB3: {ratio:.2f} times" in capsys.readouterr().out

    monkeypatch.setattr(sb3_comparison, "run", lambda name, values, path: pytest.fail("it is kept"))
    assert sb3_comparison.kept("ppo", {}, tmp_path / "smoke-512" / "ppo" / "1") == found["runs"]["ppo"][1]
