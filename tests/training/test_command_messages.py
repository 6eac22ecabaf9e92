"""What commands say when a name, a file or a run is not as it should be: one line, status 2."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import snake_env
from snake_env.policies import files
from training import cli, pace, train

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("what", ["option", "networks"])
def test_the_error_of_a_run_that_does_not_fit_names_what_it_was_begun_with(tmp_path, capsys, what):
    pytest.importorskip("torch")

    folder = tmp_path / "run"
    arguments = ["--out", str(folder), "--config", "smoke", "--no-bar", "--total-steps", "512"]
    assert train.main(["--learner", "ppo", *arguments]) == 0
    config = json.loads((folder / "config.json").read_text())
    config["policy"] |= {"hidden": [7]} if what == "networks" else {"layers": 3}
    (folder / "config.json").write_text(json.dumps(config))
    versions = json.loads((folder / "versions.json").read_text()) | {"snake_env": "0.0.1"}
    (folder / "versions.json").write_text(json.dumps(versions))
    assert train.main(["--learner", "ppo", *arguments[:2], "--resume", "--total-steps", "1024", "--no-bar"]) == 2
    told = capsys.readouterr().err
    assert f"{folder} does not resume: " in told
    assert ("size mismatch" if what == "networks" else "policy.layers = 3: expected one of hidden, log_std") in told
    assert f"snake_env 0.0.1, now {snake_env.__version__}" in told
    assert os.linesep + "It was begun with" in told


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("submit --out entry --policy gait --tasks nowhere", "task = nowhere: expected one of course, "),
        (
            "submit --out entry --policy gait --robot-class aico",
            "robot_class = 'aico': expected one of 'ideal', 'aiko'",
        ),
        ("verify nowhere", "folder = nowhere: expected one with entry.json"),
        ("gaits --env Nowhere-v0", "Environment `Nowhere` doesn't exist"),
        ("experiments.difficulty --tasks nowhere", "task = nowhere: expected one of field, "),
        (
            "evaluate --env CartPole-v1",
            "env_id = CartPole-v1: expected an id of one of this package's environments",
        ),
        (
            f"evaluate --policy {ROOT}/snake_env/policies/shipped/field-hard.safetensors --env CartPole-v1",
            "env_id = CartPole-v1: expected an id of one of this package's environments",
        ),
        (
            "evaluate --policy nowhere.zip",
            "policy = nowhere.zip: expected one of gait",
        ),
        (
            "evaluate --gait 300,120,-50",
            "gait = A 300, omega 120, beta -50 deg: expected values the environment can",
        ),
        (
            "inspect --policy nowhere",
            "policy = nowhere: expected one of gait",
        ),
        ("pipeline --config nowhere", "config = nowhere: expected a YAML or JSON file, or a name"),
        ("tune --controllers nobody", "policy = nobody: expected one of best-gait, "),
        (
            f"sweep --configs smoke {ROOT}/training/configs/smoke.yaml",
            "configs = smoke: expected configurations of different",
        ),
    ],
)
def test_a_name_that_does_not_exist_ends_a_command_with_one_line(capsys, command, told):
    pytest.importorskip("torch")
    module, *arguments = command.split()
    status = import_module(module).main(arguments) if "." in module else cli.main([module, *arguments])
    assert status == 2
    assert told in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("train --config smoke --total-steps 0", "total_steps = 0: expected greater than or equal to 1"),
        ("train --config smoke --num-envs -3", "num_envs = -3: expected greater than or equal to 1"),
        ("pipeline --config smoke --total-steps 0", "total_steps = 0: expected greater than or equal to 1"),
        ("pipeline --config smoke --seed -1", "seed = -1: expected greater than or equal to 0"),
        ("sweep --configs smoke --jobs 0", "jobs = 0: expected greater than or equal to 1"),
        ("sweep --configs smoke --seeds 0", "seeds = 0: expected greater than or equal to 1"),
        ("sweep --configs smoke --total-steps 0", "total_steps = 0: expected greater than or equal to 1"),
        ("evaluate --fields 0", "fields = 0: expected greater than or equal to 1"),
        ("evaluate --fields -1", "fields = -1: expected greater than or equal to 1"),
        ("evaluate --fields 3000000000", "count = 3000000000: expected an integer in [1, 2147483648]"),
        ("submit --out entry --policy gait --episodes 0", "episodes = 0: expected greater than or equal to 1"),
    ],
)
def test_a_number_out_of_range_ends_a_command_with_one_line(tmp_path, monkeypatch, capsys, command, told):
    for name in ("torch", "stable_baselines3"):
        pytest.importorskip(name)
    monkeypatch.chdir(tmp_path)
    module, *arguments = command.split()
    status = import_module(module).main(arguments) if "." in module else cli.main([module, *arguments])
    assert status == 2
    assert told in capsys.readouterr().err.splitlines()[-1]
    assert not list(tmp_path.iterdir()), "nothing is written"


def without_bias(path):
    files.write(path, {"actor.0.weight": np.zeros((2, 2), np.float32)}, {"env_id": "SnakeField-v1", "env": {}})


def without_run(path):
    arrays = {"actor.0.weight": np.zeros((2, 2), np.float32), "actor.0.bias": np.zeros(2, np.float32)}
    files.write(path, arrays, {})


def zip_of_something_else(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", "{}")


@pytest.mark.parametrize("options", [[], ["--env", "SnakeField-v1"]], ids=["its own task", "a task"])
@pytest.mark.parametrize(
    ("name", "write", "told"),
    [
        ("text.safetensors", lambda path: path.write_text("no such thing"), "a file that can be read ("),
        ("bias.safetensors", without_bias, "a file that can be read ("),
        ("run.safetensors", without_run, "a file with the configuration of its run, env_id and env"),
        ("text.zip", lambda path: path.write_text("no such thing"), "a file that can be read ("),
        ("other.zip", zip_of_something_else, "a file that can be read ("),
    ],
)
def test_a_broken_policy_ends_a_command_with_one_line(tmp_path, capsys, name, write, told, options):
    pytest.importorskip("stable_baselines3")
    path = tmp_path / name
    write(path)
    arguments = ["evaluate", "--policy", str(path), "--fields", "1", "--out", str(tmp_path / "out"), *options]
    assert cli.main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"policy = {path}: expected ")
    assert told in line


@pytest.mark.parametrize("command", ["train", "pipeline", "sweep"])
@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        ("cut.json", '{"ppo": {"gamma": 0.9', "cut.json: expected JSON (Expecting"),
        ("cut.yaml", "ppo: {gamma: 0.9", "cut.yaml: expected YAML (while parsing a flow mapping"),
        ("bytes.yaml", b"\xff\x00", "bytes.yaml: expected YAML ('utf-8' codec can't decode"),
        ("list.json", "[1, 2]", "list.json: expected a mapping of names to values"),
        ("section.json", '{"ppo": 3}', "ppo = 3: expected a mapping of names to values"),
        ("date.yaml", "total_steps: 2026-11-25", "total_steps = 2026-11-25: expected a valid integer"),
        (
            "set.yaml",
            "env: !!set {difficulty}",
            "set.yaml: expected YAML (Object of type set is not JSON serializable)",
        ),
        ("learner.yaml", "learner: [ppo]", "learner = ['ppo']: expected one of sb3, ppo, evolution"),
        ("twice.yaml", "ppo: {gamma: 0.9, gamma: 0.99}", "twice.yaml: expected YAML (gamma is there twice)"),
        ("twice.json", '{"seed": 1, "seed": 2}', "twice.json: expected JSON (seed is there twice)"),
        (
            "river.json",
            '{"env_id": "SnakeRiver-v1"}',
            "env_id = SnakeRiver-v1: expected an id of one of this package's",
        ),
    ],
)
def test_a_broken_configuration_ends_a_command_with_one_line(tmp_path, capsys, command, file, content, told):
    pytest.importorskip("torch")
    path = tmp_path / file
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    given = "--configs" if command == "sweep" else "--config"
    assert cli.main([command, given, str(path), "--out", str(tmp_path / "run")]) == 2
    assert told in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "run").exists(), "the folder is left free"


def test_what_the_command_line_overrides_is_checked(tmp_path, capsys):
    arguments = ["train", "--config", "smoke", "--out", str(tmp_path / "run")]
    with pytest.raises(SystemExit, match="2"):
        cli.main([*arguments, "--ppo.gamma", "1.5"])
    told = capsys.readouterr().err
    assert "gamma" in told
    assert "less than or equal to 1" in told
    with pytest.raises(SystemExit, match="2"):
        cli.main([*arguments, "--policy.symmetric"])
    assert "symmetric" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_resumed_run_keeps_its_configuration(tmp_path, capsys):
    arguments = ["train", "--config", "smoke", "--no-bar", "--out", str(tmp_path / "run"), "--total-steps", "256"]
    assert cli.main(arguments) == 0
    assert cli.main([*arguments[:-1], "512", "--resume", "--seed", "7"]) == 2
    assert "seed = 7: expected 0, with which the run was begun" in capsys.readouterr().err
    assert cli.main([*arguments[:-1], "512", "--resume"]) == 0
    assert cli.main([*arguments[:-1], "256", "--resume"]) == 2
    assert "total_steps = 256: expected at least 512, which " in capsys.readouterr().err
    assert json.loads((tmp_path / "run" / "config.json").read_text())["total_steps"] == 512


@pytest.mark.parametrize("command", ["training train", "experiments.seed_statistics"])
def test_help_names_the_command_as_it_is_typed(command):
    asked = subprocess.run([sys.executable, "-m", *command.split(), "--help"], cwd=ROOT, capture_output=True, text=True)
    assert asked.stdout.splitlines()[0].startswith(f"usage: python -m {command} [-h]")


@pytest.mark.parametrize("learner", ["sb3", "ppo"])
@pytest.mark.parametrize("seconds", [0.0, 60.0])
def test_a_file_gets_a_line_of_progress_per_minute(learner, seconds, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pace, "IN_A_FILE", seconds)
    arguments = ["train", "--config", "smoke", "--learner", learner, "--out", str(tmp_path), "--total-steps", "512"]
    assert cli.main(arguments) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "k/s, success" in line]
    assert len(lines) == (2 if seconds == 0.0 else 0)


def test_the_commands_are_listed(capsys):
    assert cli.main(["--help"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in cli.COMMANDS)
    assert cli.main(["fly"]) == 2
