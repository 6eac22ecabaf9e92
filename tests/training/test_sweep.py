"""Several seeds from one command: all finish, the best is kept, a stopped sweep goes on."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip("torch")

from training import config, seeds
from training.policies import files
from training.search import sweep

SMOKE = {
    "learner": "ppo",
    "env_id": "SnakeFree-v0",
    "env": {"max_episode_steps": 40},
    "num_envs": 8,
    "policy": {"hidden": [8]},
    "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1},
    "checkpoint_seconds": 0.0,
}


@pytest.fixture
def tiny(tmp_path):
    """A configuration that trains in a second."""
    path = tmp_path / "tiny.json"
    config.save(config.parse(config.PpoConfig, SMOKE), path)
    return path


def test_every_seed_trains_and_the_best_is_kept(tiny, tmp_path, capsys):
    out = tmp_path / "sweep"
    arguments = ["--configs", str(tiny), "--seeds", "2", "--jobs", "2", "--out", str(out), "--fields", "3"]
    assert sweep.main([*arguments, "--total-steps", "1024"]) == 0
    found = json.loads((out / "tiny" / "seeds.json").read_text())
    assert [row["run"] for row in found["seeds"]] == ["seed-0", "seed-1"]
    best = max(found["seeds"], key=lambda row: row["is_success"] + row["speed"])["run"]
    assert found["best"] == best
    kept = (out / "tiny" / "best.safetensors").read_bytes()
    assert kept == (out / "tiny" / best / files.NAME).read_bytes()
    assert files.read(out / "tiny" / "seed-1" / files.NAME)[1]["seed"] == 1
    assert (out / "tiny" / "learning-curves.png").stat().st_size > 5000
    before = (out / "tiny" / "seed-0" / files.NAME).stat().st_mtime_ns
    assert sweep.main([*arguments, "--total-steps", "1024"]) == 0
    assert (out / "tiny" / "seed-0" / files.NAME).stat().st_mtime_ns == before, "finished runs stay"


def test_a_run_that_fails_is_named(tmp_path, capsys):
    broken = tmp_path / "broken.json"
    broken.write_text('{"env_id": "SnakeFree-v0", "env": {"colour": 1}}')
    assert sweep.main(["--configs", str(broken), "--seeds", "1", "--out", str(tmp_path / "out")]) == 1
    assert "seed-0 failed: see" in capsys.readouterr().err


def test_a_stopped_sweep_is_saved_and_the_same_command_goes_on(tiny, tmp_path):
    out = tmp_path / "sweep"
    command = [sys.executable, "-m", "training", "sweep", "--configs", str(tiny), "--seeds", "2", "--jobs", "2"]
    command += ["--out", str(out), "--fields", "2"]
    process = subprocess.Popen([*command, "--total-steps", "100000000"], stdout=subprocess.PIPE, text=True)
    end = time.monotonic() + 100
    while len(list(out.glob("tiny/*/checkpoints/*.pt"))) < 2 and time.monotonic() < end:
        time.sleep(0.1)
    os.kill(process.pid, signal.SIGTERM)
    assert "the same command goes on" in process.communicate(timeout=60)[0]
    assert process.returncode == 130
    steps = [int(path.stem) for path in out.glob("tiny/*/checkpoints/*.pt")]
    assert subprocess.run([*command, "--total-steps", str(max(steps) + 256)], check=False).returncode == 0
    assert len(list(out.glob("tiny/*/finished.json"))) == 2


def test_seeds_for_comparing_runs_are_for_choosing():
    assert all(seed in seeds.SELECTION for seed in seeds.selection(sweep.FIELDS, sweep.SKIP))
