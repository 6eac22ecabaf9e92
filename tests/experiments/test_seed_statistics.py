"""What a sweep's seeds say together: means, spread and differences between equal seeds."""

import json
import shutil

import pytest

pytest.importorskip("torch")

from experiments import seed_statistics
from snake_env.evaluation import seeds, tasks
from training import config, runs
from training.evaluation import cached_scores
from training.learners import ppo

SMOKE = {
    "learner": "ppo",
    "env_id": "SnakeFree-v1",
    "env": {"max_episode_steps": 40},
    "num_envs": 8,
    "total_steps": 1024,
    "policy": {"hidden": [8]},
    "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1},
}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Two seeds of two configurations that differ in name alone, and a run that has not been finished."""
    folder = tmp_path_factory.mktemp("swept")
    for name in ("one", "two"):
        for seed in range(2):
            settings = config.parse(config.PpoConfig, SMOKE | {"seed": seed})
            run = runs.RunFolder(folder / "sweep" / name / f"seed-{seed}")
            run.create(settings)
            assert ppo.train(run, settings, show=False) == 0
    runs.RunFolder(folder / "sweep" / "one" / "seed-10").create(config.PpoConfig())
    return folder / "sweep"


def test_equal_runs_do_not_differ_and_unfinished_ones_do_not_count(swept, tmp_path, capsys):
    arguments = ["--sweep", str(swept), "--configs", "one", "two", "--fields", "3", "--out", str(tmp_path)]
    assert seed_statistics.main([*arguments, "--num-threads", "1"]) == 0
    found = json.loads((tmp_path / "seed-statistics.json").read_text())
    assert found["scores"]["one"] == found["scores"]["two"]
    assert [len(values) for values in found["scores"]["one"].values()] == [2, 2]
    printed = capsys.readouterr().out
    assert "one against two, seed by seed: success +0.000 [+0.000, +0.000], better with probability 0.50" in printed
    assert (tmp_path / "learning-curves.png").stat().st_size > 5000


def test_the_best_policy_of_each_seed_plays_where_it_is_asked_for(swept, tmp_path, monkeypatch):
    played = []
    trained = seed_statistics.cached_scores.trained
    monkeypatch.setattr(
        seed_statistics.cached_scores, "trained", lambda *given: played.append(given[1].name) or trained(*given)
    )
    arguments = ["--sweep", str(swept), "--configs", "one", "--fields", "2", "--out", str(tmp_path)]
    for more in ([], ["--best"]):
        assert seed_statistics.main([*arguments, *more]) == 0
    assert played == ["policy.safetensors"] * 2 + ["best.safetensors"] * 2


def test_all_play_in_the_task_of_the_benchmark_if_one_is_named(swept, tmp_path, monkeypatch):
    longer = tasks.BenchmarkTask("longer", "SnakeFree-v1", {"max_episode_steps": 80})
    monkeypatch.setattr(tasks, "chosen", lambda names: [longer] if names == ["longer"] else [])
    arguments = ["--sweep", str(swept), "--configs", "one", "--fields", "2", "--num-threads", "1"]
    tables = []
    for more in ([], ["--task", "longer"]):
        assert seed_statistics.main([*arguments, "--out", str(tmp_path), *more]) == 0
        tables.append(json.loads((tmp_path / "seed-statistics.json").read_text())["scores"]["one"])
    assert tables[0] != tables[1]


def test_a_score_is_that_of_the_seeds_own_policy(swept, tmp_path):
    """A seed keeps its score when the other one is gone."""
    bench = cached_scores.Bench(tmp_path / "cells", seeds.held_out(3), 1)
    both = seed_statistics.score(seed_statistics.finished(swept / "two"), bench)
    shutil.copytree(swept / "two" / "seed-1", tmp_path / "alone" / "seed-1")
    alone = seed_statistics.score(seed_statistics.finished(tmp_path / "alone"), bench)
    speed = both["speed [m/s]"]
    assert alone["speed [m/s]"] == {"seed-1": speed["seed-1"]}
    assert speed["seed-0"] != speed["seed-1"]


def test_the_interval_is_students_over_seeds():
    """Differences 1, 2 and 3: mean 2, standard error 1 / sqrt 3, and 4.303 of these to either side.

    A seed that one configuration alone has does not count.
    """
    table = {"success": {"seed-0": 2.0, "seed-1": 9.0, "seed-2": 4.0, "seed-3": 6.0}}
    reference = {"success": {"seed-0": 1.0, "seed-2": 2.0, "seed-3": 3.0}}
    said = seed_statistics.against(table, reference, "a", "b")
    assert said == "a against b, seed by seed: success +2.000 [-0.484, +4.484], better with probability 0.88."
    assert (
        seed_statistics.against(table, {"success": {"seed-1000": 1.0}}, "a", "b") == "a and b have no seed in common."
    )


def test_one_seed_has_no_interval():
    said = seed_statistics.against({"success": {"seed-0": 0.5}}, {"success": {"seed-0": 0.25}}, "a", "b")
    assert said == "a against b, seed by seed: success +0.250, one seed."


def test_a_configuration_without_finished_runs_is_named(tmp_path, capsys):
    assert seed_statistics.main(["--sweep", str(tmp_path), "--configs", "absent"]) == 2
    assert "configs = absent: expected one with finished runs" in capsys.readouterr().err
