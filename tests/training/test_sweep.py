"""Several seeds from one command: all finish, the best is kept, a stopped sweep goes on."""

import json
import os
import signal
import threading
import time

import pytest

pytest.importorskip("torch")

from snake_env.evaluation import seeds
from snake_env.policies import files
from training import cli, config, runs
from training.search import sweep

SMOKE = {
    "learner": "ppo",
    "env_id": "SnakeFree-v1",
    "env": {"max_episode_steps": 40},
    "num_envs": 8,
    "policy": {"hidden": [8]},
    "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1},
    "checkpoint_steps": 0,
    "evaluations": 0,
}


@pytest.fixture
def tiny(tmp_path):
    """A configuration that trains in a second."""
    path = tmp_path / "tiny.json"
    config.save(config.parse(config.PpoConfig, SMOKE), path)
    return path


def test_a_stopped_sweep_goes_on_to_its_end_and_the_best_is_kept(tiny, tmp_path, capsys):
    out = tmp_path / "sweep"
    arguments = ["sweep", "--configs", str(tiny), "--seeds", "2", "--jobs", "2", "--out", str(out), "--fields", "3"]

    def stop():
        end = time.monotonic() + 100
        while len(list(out.glob("tiny/*/checkpoints/*.pt"))) < 2 and time.monotonic() < end:
            time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=stop).start()
    assert cli.main([*arguments, "--total-steps", "100000000"]) == 130
    assert "the same command continues" in capsys.readouterr().out
    assert not list(out.glob("tiny/*/finished.json"))
    steps = max(int(path.stem) for path in out.glob("tiny/*/checkpoints/*.pt"))
    assert cli.main([*arguments, "--total-steps", str(steps + 256)]) == 0
    found = json.loads((out / "tiny" / "seeds.json").read_text())
    assert [row["run"] for row in found["seeds"]] == ["seed-0", "seed-1"]
    best = max(found["seeds"], key=lambda row: row["is_success"] + row["speed"])["run"]
    assert found["best"] == best
    kept = (out / "tiny" / "best.safetensors").read_bytes()
    assert kept == (out / "tiny" / best / files.NAME).read_bytes()
    assert files.read(out / "tiny" / "seed-1" / files.NAME)[1]["seed"] == 1
    assert (out / "tiny" / "learning-curves.png").stat().st_size > 5000
    before = (out / "tiny" / "seed-0" / files.NAME).stat().st_mtime_ns
    assert cli.main([*arguments, "--total-steps", str(steps + 256)]) == 0
    assert (out / "tiny" / "seed-0" / files.NAME).stat().st_mtime_ns == before, "finished runs stay"


def test_finished_runs_continue_to_a_larger_budget_and_refuse_a_smaller_one(tiny, tmp_path, capsys):
    given = ["sweep", "--configs", str(tiny), "--seeds", "1", "--jobs", "1", "--out", str(tmp_path), "--fields", "2"]
    run = runs.RunFolder(tmp_path / "tiny" / "seed-0")
    for steps in (256, 512):
        assert cli.main([*given, "--total-steps", str(steps)]) == 0
        assert files.read(run.policy)[1]["steps"] == run.config().total_steps == steps
    assert "Fatal" not in (run.path / "log.txt").read_text(), "the thread that reads the standard input ends quietly"
    assert cli.main([*given, "--total-steps", "256"]) == 2
    assert "total_steps = 256: expected at least 512, which " in capsys.readouterr().err
    assert run.config().total_steps == 512


def test_a_finished_run_whose_budget_was_raised_has_not_finished(tmp_path):
    """Even if it was killed before its next checkpoint."""
    run = runs.RunFolder(tmp_path)
    smoke = config.parse(config.PpoConfig, SMOKE)
    run.create(smoke.with_changes(total_steps=500))
    files.write(run.policy, {}, {})
    run.finish({"steps": 512})
    assert run.finished
    assert run.has_taken(512)
    run.create(smoke.with_changes(total_steps=1000))
    assert not run.finished
    assert run.has_taken(500)


def test_a_run_that_fails_is_named(tiny, tmp_path, capsys):
    other = runs.RunFolder(tmp_path / "out" / "tiny" / "seed-0")
    other.create(config.load(tiny).with_changes(seed=3))
    assert cli.main(["sweep", "--configs", str(tiny), "--seeds", "1", "--out", str(tmp_path / "out")]) == 1
    assert "seed-0 failed: see" in capsys.readouterr().err
    assert "seed = 0: expected 3" in (other.path / "log.txt").read_text()


def test_seeds_for_comparing_runs_are_for_choosing():
    assert all(seed in seeds.SELECTION for seed in seeds.selection(sweep.FIELDS, sweep.SKIP))


def test_a_configuration_that_is_not_there_is_refused_before_anything_runs(tiny, tmp_path, capsys):
    arguments = ["sweep", "--configs", str(tiny), "nowhere", "--total-steps", "100", "--out", str(tmp_path / "out")]
    assert cli.main(arguments) == 2
    assert "nowhere" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
