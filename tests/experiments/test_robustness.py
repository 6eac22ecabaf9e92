"""Randomised parameters: the same tasks with and without them, the policy before and the seeds after."""

import json

import pytest

pytest.importorskip("torch")

from experiments import robustness
from training import config, runs
from training.learners import ppo

SMOKE = {
    "env": {"max_episode_steps": 20, "randomization": {"friction": [0.5, 0.5]}, "action_mode": "residual"},
    "tasks": {"course": 4, "maze": 4},
    "num_envs": 8,
    "total_steps": 256,
    "evaluations": 0,
    "policy": {"hidden": [8]},
    "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1},
}


def test_randomised_tasks_differ_from_nominal_ones_in_the_randomisation_only():
    run = config.parse(config.PpoConfig, SMOKE)
    nominal, randomised = (robustness.tasks(run, one) for one in (False, True))
    for before, after in zip(nominal, randomised, strict=True):
        assert before.name == after.name
        assert after.options == before.options | {"randomization": {"friction": [0.5, 0.5]}}


def test_the_table_has_both_policies_in_both_conditions(tmp_path, capsys):
    for seed in range(2):
        settings = config.parse(config.PpoConfig, SMOKE | {"seed": seed})
        run = runs.RunFolder(tmp_path / "sweep" / "small" / f"seed-{seed}")
        run.create(settings)
        assert ppo.train(run, settings, show=False) == 0
    arguments = ["--sweep", str(tmp_path / "sweep"), "--config", "small", "--fields", "2", "--num-threads", "1"]
    assert robustness.main([*arguments, "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "robustness.json").read_text())["tasks"]
    assert list(found) == ["course", "maze"]
    for of_task in found.values():
        assert [list(of) for of in of_task.values()] == [["general", "seed-0", "seed-1"]] * 2
        assert of_task["nominal"]["general"]["speed"] != of_task["randomised"]["general"]["speed"]
    assert "| `course` |" in capsys.readouterr().out
