"""Algorithms on one task: all take the same steps, a stopped comparison continues, missing seeds are seen."""

import json

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from experiments import algorithms
from snake_env.zoo.tqc import hyperparams
from training import config_file


@pytest.fixture
def small(tmp_path, monkeypatch):
    values = config_file.read("algorithms") | {"num_envs": 8, "total_steps": 512, "policy": {"hidden": [8, 8]}}
    values |= {"env": {"max_episode_steps": 20}, "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1}}
    (tmp_path / "small.json").write_text(json.dumps(values))
    for zoo in (algorithms.sac, hyperparams):
        monkeypatch.setitem(zoo["SnakeField-v1"], "learning_starts", 100)
    return ["--config", str(tmp_path / "small.json"), "--fields", "2", "--out", str(tmp_path / "out")]


def test_finished_seeds_are_kept_and_fewer_seeds_are_said(small, tmp_path, monkeypatch, capsys):
    assert algorithms.main([*small, "--seeds", "1"]) == 0
    found = json.loads((tmp_path / "out" / "algorithms.json").read_text())
    assert {name: len(rows) for name, rows in found["runs"].items()} == dict.fromkeys(algorithms.KINDS, 1)
    for name in algorithms.KINDS:
        curve = algorithms.RunFolder(tmp_path / "out" / "small-512-2" / name / "seed-0").read_curve()
        assert curve[-1]["steps"] == 512, name
    trained = []
    for name in ("recurrent PPO", "TQC"):
        kind = algorithms.KINDS[name]
        monkeypatch.setitem(algorithms.KINDS, name, lambda *given, kind=kind: trained.append(1) or kind(*given))
    assert algorithms.main([*small, "--seeds", "2", "--algorithms", "recurrent PPO"]) == 0
    assert len(trained) == 1
    lines = [line.split(" | ")[:2] for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    assert ["| recurrent PPO", "2"] in lines
    assert ["| TQC", "1"] in lines
    assert (tmp_path / "out" / "learning-curves.png").stat().st_size > 5000


def test_scores_of_other_settings_are_not_shown(small, tmp_path, monkeypatch, capsys):
    """Other steps, fields and configurations have folders of their own."""

    def train(folder, config):
        folder.create(config)
        return config.total_steps

    monkeypatch.setattr(algorithms, "KINDS", {"ppo": train})
    signals = {"is_success": np.ones(1, bool), "speed": np.ones(1)}
    played = []
    monkeypatch.setattr(
        algorithms.rollout,
        "run_episodes",
        lambda policy, _, fields, *__, **___: played.append((policy, len(fields))) or signals,
    )
    monkeypatch.setattr(algorithms.figures, "learning_curves", lambda *_: None)
    other = ["--config", "algorithms", *small[2:]]
    runs = [small, [*small, "--steps", "1024"], [*small, "--fields", "3"], [*other, "--steps", "512"], small]
    for arguments in runs:
        assert algorithms.main([*arguments, "--seeds", "1", "--algorithms", "ppo"]) == 0
    assert played == [(512, 2), (1024, 2), (512, 3), (512, 2)]
    found = json.loads((tmp_path / "out" / "algorithms.json").read_text())
    assert (found["config"], found["steps"], found["fields"]) == (small[1], 512, 2)
