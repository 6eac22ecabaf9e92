"""A run's folder: one writer, whole files, and nothing that a process leaves behind blocks the next one."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("torch")

from snake_env import ConfigError
from training import cli, config, runs, train

TINY = {
    "env_id": "SnakeFree-v1",
    "env": {"max_episode_steps": 40},
    "num_envs": 8,
    "policy": {"hidden": [8]},
    "checkpoint_steps": 0,
    "evaluations": 0,
}
PPO = TINY | {"learner": "ppo", "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1}}
EVOLUTION = TINY | {"learner": "evolution", "num_envs": 16, "evolution": {"fields": 2}}


@pytest.fixture(params=[PPO, EVOLUTION], ids=["ppo", "evolution"])
def any_learner(request, tmp_path):
    path = tmp_path / "any.json"
    path.write_text(json.dumps(request.param))
    return path


@pytest.fixture
def tiny(tmp_path):
    path = tmp_path / "tiny.json"
    config.save(config.parse(config.PpoConfig, PPO), path)
    return path


def truncate(path):
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def spoil(path):
    """A byte of the data of an archive is another one."""
    content = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        largest = max(archive.infolist(), key=lambda one: one.file_size)
    content[largest.header_offset + 30 + len(largest.filename) + largest.file_size // 2 + 64] ^= 0xFF
    path.write_bytes(content)


@pytest.mark.parametrize("damage", [truncate, spoil, lambda path: path.write_bytes(b"")])
def test_a_damaged_last_checkpoint_gives_way_to_the_one_before(any_learner, tmp_path, damage):
    out = tmp_path / "run"
    command = ["--out", str(out), "--no-bar"]
    assert train.main([*command, "--config", str(any_learner), "--total-steps", "6000"]) == 0
    folder = runs.RunFolder(out)
    before, last = sorted(folder.checkpoints.iterdir(), key=lambda path: int(path.stem))[-2:]
    assert folder.latest() == last
    damage(last)
    assert folder.latest() == before
    assert train.main([*command, "--resume", "--total-steps", "9000"]) == 0
    steps = [row["steps"] for row in folder.read_curve()]
    assert steps == sorted(set(steps))
    assert steps[-1] >= 9000


def test_checkpoints_are_kept_in_the_order_of_their_steps(tmp_path):
    folder = runs.RunFolder(tmp_path)
    folder.checkpoints.mkdir()

    def save(path):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("x", "x")

    numbers = [999_998_000, 999_999_000, 1_000_000_000, 1_000_001_000]
    for steps in numbers:
        folder.save_checkpoint(save, steps, 1.0, ".pt")
    assert sorted(int(path.stem) for path in folder.checkpoints.iterdir()) == numbers[1:]
    assert int(folder.latest().stem) == numbers[-1]
    (folder.checkpoints / f"{numbers[-1]}.pt").write_bytes(b"")
    folder.save_checkpoint(save, numbers[-2] + 1, 1.0, ".pt")
    assert sorted(int(path.stem) for path in folder.checkpoints.iterdir()) == [*numbers[1:3], numbers[-2] + 1]


def test_a_line_of_the_curve_that_was_cut_off_is_left_out(tmp_path):
    folder = runs.RunFolder(tmp_path)
    for steps in (1, 2):
        folder.append_curve({"steps": steps})
    content = folder.curve.read_bytes()
    folder.curve.write_bytes(content[:-4])
    assert [row["steps"] for row in folder.read_curve()] == [1]
    folder.create(config.PpoConfig())
    folder.append_curve({"steps": 3})
    assert [row["steps"] for row in folder.read_curve()] == [1, 3]


COMMANDS = {
    "train": ["train", "--no-bar", "--config"],
    "resume": ["train", "--resume", "--no-bar", "--config"],
    "pipeline": ["pipeline", "--config"],
    "pipeline --fresh": ["pipeline", "--fresh", "--config"],
    "sweep": ["sweep", "--configs"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_second_process_may_not_write_in_a_folder(tiny, tmp_path, capsys, name):
    out = tmp_path / "run"
    (out / "policy").mkdir(parents=True)
    (out / "policy" / "kept").touch()
    with runs.sole_writer(out):
        assert cli.main([*COMMANDS[name], str(tiny), "--out", str(out)]) == 2
    assert "a folder in which no other process writes" in capsys.readouterr().err
    assert (out / "policy" / "kept").exists()


def test_a_folder_is_free_when_its_writer_was_killed(tmp_path):
    code = f"from training.runs import *\nwith sole_writer(Path({str(tmp_path)!r})): print(flush=True); input()"
    writer = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    writer.stdout.readline()
    with pytest.raises(ConfigError), runs.sole_writer(tmp_path):
        pass
    writer.kill()
    writer.wait()
    with runs.sole_writer(tmp_path):
        pass


def wait_until(condition, seconds=120):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    assert condition()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=["terminate", "kill"])
def test_what_ends_before_it_learns_leaves_nothing_that_blocks_the_same_command(tiny, tmp_path, number):
    out = tmp_path / "run"
    arguments = ["--out", str(out), "--config", str(tiny), "--no-bar", "--total-steps", "512"]
    code = f"""
import signal, training.learners.ppo, training.train
training.learners.ppo.train = lambda *_: signal.pause()
training.train.main({arguments!r})
"""
    process = subprocess.Popen([sys.executable, "-c", code])
    wait_until((out / "config.json").exists)
    process.send_signal(number)
    assert process.wait() == -number
    assert train.main(arguments) == 0
    assert train.main(arguments) == 2, "now it holds a run"


def test_the_configuration_of_something_else_is_not_overwritten(tiny, tmp_path, capsys):
    (tmp_path / "config.json").write_text("of something else")
    assert train.main(["--out", str(tmp_path), "--config", str(tiny), "--no-bar"]) == 2
    assert "already holds a run" in capsys.readouterr().err
    assert (tmp_path / "config.json").read_text() == "of something else"


def test_the_runs_of_a_sweep_end_with_it(tiny, tmp_path):
    """Killed, it cannot stop them; they notice, save and end."""
    out = tmp_path / "sweep"
    command = [sys.executable, "-m", "training", "sweep", "--configs", str(tiny), "--seeds", "2", "--jobs", "2"]
    parent = subprocess.Popen([*command, "--out", str(out), "--total-steps", "100000000"])
    wait_until(lambda: all(list(out.glob(f"tiny/seed-{k}/checkpoints/*.pt")) for k in (0, 1)))
    children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split()
    assert len(children) == 2
    parent.kill()
    parent.wait()
    wait_until(lambda: not any(_lives(int(child)) for child in children), 60)
    for folder in (out / "tiny").iterdir():
        assert "saved after" in (folder / "log.txt").read_text()


def _lives(process):
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().split(")")[1].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
