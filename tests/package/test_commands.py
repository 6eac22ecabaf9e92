"""The command line `snake-env`."""

from __future__ import annotations

import json
import re
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from conftest import run_python

from snake_env.__main__ import COMMANDS, main
from snake_env.commands import bench
from snake_env.evaluation.rollout import layout_of
from snake_env.evaluation.tasks import acting_in
from snake_env.vector_env import SnakeVectorEnv


def test_evaluate_scores_policies_controllers_and_gaits(capsys, tmp_path):
    out = tmp_path / "scores.json"
    named = ["--policy", "field-hard", "--policy", "heading control", "--policy", "gait", "--policy", "30,120,-50"]
    assert main(["evaluate", "--task", "field-hard", "--scenes", "2", "--out", str(out), *named]) == 0
    printed = capsys.readouterr().out
    scored = json.loads(out.read_text())["scores"]
    assert list(scored) == ["field-hard", "heading control", "thesis gait", "A 30, omega 120, beta -50 deg"]
    assert all(name in printed for name in scored)
    assert scored["field-hard"]["success"]["value"] in (0.0, 0.5, 1.0)


def test_a_shipped_policy_is_scored_in_the_task_of_its_training(capsys):
    assert main(["evaluate", "--policy", "corridor", "--scenes", "1"]) == 0
    assert capsys.readouterr().out.startswith("SnakeCorridor-v1")


def test_play_films_a_test_scene(capsys, tmp_path):
    pytest.importorskip("imageio")
    film = tmp_path / "film.gif"
    options = ["--options", '{"max_episode_steps": 4}', "--film", str(film)]
    assert main(["play", "--policy", "corridor", *options]) == 0
    assert capsys.readouterr().out.startswith("corridor, corridor, test scene 0: failed")
    assert film.read_bytes().startswith(b"GIF")


@pytest.mark.parametrize("name", ["film.avi", "film.MOV", "film.v2"])
def test_a_film_is_of_a_known_kind_and_replaces_no_other(name, tmp_path, capsys, monkeypatch):
    pytest.importorskip("imageio")
    monkeypatch.setattr("snake_env.evaluation.film.play", lambda *_, **__: pytest.fail("it was played"))
    (tmp_path / "film.mp4").write_text("another film")
    assert main(["play", "--film", str(tmp_path / name)]) == 2
    assert "expected a name that ends in .mp4 or .gif" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]
    assert (tmp_path / "film.mp4").read_text() == "another film"


@pytest.mark.parametrize("task", ["spatial-open", "spatial-field", "course"])
def test_the_default_gait_is_action_zero(task):
    gait, found = acting_in("gait", task)
    gait.begin(layout_of(found.env_id, found.options | gait.env_options), 1)
    np.testing.assert_allclose(gait.action, 0.0, atol=1e-12)
    assert gait.action.shape == ((6,) if "spatial" in task else (4,))


def test_in_3d_the_default_gait_moves_on(tmp_path):
    out = tmp_path / "scores.json"
    short = ["--scenes", "1", "--options", '{"max_episode_steps": 100}', "--out", str(out)]
    assert main(["evaluate", "--task", "spatial-open", *short]) == 0
    assert json.loads(out.read_text())["scores"]["default gait"]["speed"]["value"] > 0.08, "m/s"


def test_bench_prints_a_row_per_environment(capsys, monkeypatch):
    monkeypatch.setattr(bench, "in_readme", lambda: {"SnakeFree-v1": 400.0})
    monkeypatch.setattr(bench, "rate", lambda *given: (200.0, 100.0) if given[-1] else (300.0, 100.0))
    assert main(["bench", "--seconds", "0.02", "--num-envs", "2", "--env", "SnakeFree-v1"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("| `SnakeFree-v1` | "))
    assert row.endswith(" | 0.50 |")


def test_bench_counts_processor_time_as_the_readme_does(monkeypatch):
    """While a process waits, its wall time goes on and its processor time does not."""
    step = SnakeVectorEnv.step

    def waits(self, actions):
        time.sleep(0.02)
        return step(self, actions)

    monkeypatch.setattr(SnakeVectorEnv, "step", waits)
    processor, wall = bench.rate("SnakeFree-v1", 1, 1, 0.3, random=False)
    assert wall < 50.0
    assert processor > 3.0 * wall


def test_bench_measures_the_environments_of_the_readme(monkeypatch):
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    speed = readme.partition("\n## Speed\n")[2].partition("\n## ")[0]
    assert "per CPU second" in speed
    assert set(re.findall(r"^\| `(\w+-v1)`", speed, re.MULTILINE)) == set(bench.IDS)
    monkeypatch.setattr(bench, "metadata", lambda _: readme)
    found = bench.in_readme()
    assert set(found) < set(bench.IDS)
    assert f"| `SnakeField-v1` | gait | {found['SnakeField-v1']:,.0f} |" in speed


def test_card_of_a_policy(capsys):
    assert main(["card", "thrifty"]) == 0
    assert capsys.readouterr().out.startswith("# thrifty\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evaluate", "--policy", "nix"], "policy = nix: expected one of"),
        (["evaluate", "--task", "nix"], "task = nix: expected one of course"),
        (["evaluate", "--policy", "1,2,x"], "policy = 1,2,x: expected one of gait"),
        (["evaluate", "--policy", "30,9999,-50"], "gait = A 30"),
        (["evaluate", "--task", "maze", "--policy", "field-hard", "--options", '{"nearest_pegs": 3}'], "nearest_pegs"),
        (["evaluate", "--task", "maze", "--policy", "follow the leader"], "one tuned for maze: best-gait"),
        (["play", "--env", "CartPole-v1"], "env_id = CartPole-v1"),
        (["bench", "--env", "SnakeNix-v1"], "SnakeNix"),
    ],
)
def test_bad_input_is_one_line_and_status_two(arguments, message, capsys):
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


@pytest.mark.parametrize("arguments", [["evaluate", "--scenes", "0"], ["play", "--scene", "-1"]])
def test_numbers_out_of_range_are_refused(arguments, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "expected an integer" in capsys.readouterr().err


@pytest.mark.parametrize("seconds", ["nan", "-1", "0", "inf"])
def test_bench_measures_for_some_time(seconds, capsys):
    with pytest.raises(SystemExit) as left:
        main(["bench", "--seconds", seconds])
    assert left.value.code == 2
    assert "--seconds" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("module", "extra", "arguments"),
    [
        ("scipy", "evaluate", ["evaluate", "--scenes", "1"]),
        ("pygame", "render", ["play"]),
        ("imageio", "video", ["play", "--film", "film.mp4"]),
        ("PIL", "video", ["play", "--film", "film.gif"]),
        ("viser", "view", ["view"]),
        ("trimesh", "view", ["view"]),
        ("matplotlib", "reproduce", ["reproduce"]),
    ],
)
def test_a_missing_package_is_named_with_its_extra(module, extra, arguments, tmp_path, monkeypatch):
    code = f"""
        import sys
        sys.modules["{module}"] = None
        sys.stderr = sys.stdout
        from snake_env.__main__ import main
        print(main({arguments}))
    """
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    monkeypatch.chdir(tmp_path)
    assert run_python(code) == f"{module} is missing: pip install 'snake-robot-env[{extra}]'\n2"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("module", "extra", "call"),
    [
        ("stable_baselines3", "sb3", "snake_env.sb3.make('SnakeFree-v1')"),
        ("stable_baselines3", "sb3", "importlib.import_module('snake_env.sb3')"),
        ("viser", "view", "snake_env.simulate(duration=0.1).save('a.html')"),
        ("viser", "view", "snake_env.simulate(duration=0.1).view()"),
        ("imageio", "video", "snake_env.simulate(duration=0.1).save('a.mp4')"),
        ("imageio", "video", "snake_env.film('general', 'SnakeFree-v1', 'a.mp4')"),
        ("viser", "view", "snake_env.view('general')"),
        ("pandas", "data", "snake_env.simulate(duration=0.1).to_dataframe()"),
        ("pyarrow", "data", "snake_env.simulate(duration=0.1).save('a.parquet')"),
        ("onnxruntime", "onnx", "snake_env.load_policy('b.onnx')"),
        ("onnx", "onnx", "snake_env.policies.onnx_file.export(snake_env.load_policy('general'), 'a.onnx')"),
        ("torch", "sb3", "snake_env.load_policy('b.zip')"),
        ("rsl_rl", "rsl-rl", "snake_env.rsl_rl.make('SnakeFree-v1')"),
        ("torch", "sb3", "snake_env.load_policy('b.pt', trust=True)"),
        ("yaml", "yaml", "snake_env.Scene().save('a.yaml')"),
        ("yaml", "yaml", "snake_env.Scene.load('b.yaml')"),
        ("mujoco", "mujoco", "snake_env.Robot.from_mjcf('b.xml')"),
        ("scipy", "evaluate", "snake_env.evaluation.evaluate(lambda o: o[:, :4], scenes=1)"),
        ("pygame", "render", "None"),
    ],
)
def test_python_names_the_extra_of_a_missing_package(module, extra, call, tmp_path, monkeypatch):
    code = f"""
        import importlib, sys, gymnasium, snake_env
        sys.modules["{module}"] = None
        try:
            found = {call}
            env = gymnasium.make("SnakeFree-v1", render_mode="rgb_array")
            env.reset(seed=0)
            env.render()
        except ImportError as error:
            print(error)
    """
    (tmp_path / "b.yaml").write_text("format: snake_env scene 1")
    for name in ("b.onnx", "b.pt"):
        (tmp_path / name).touch()
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as archive:
        archive.writestr("data", "{}")
        archive.writestr("policy.pth", "")
    given = sorted(path.name for path in tmp_path.iterdir())
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    monkeypatch.chdir(tmp_path)
    assert run_python(code) == f"{module} is missing: pip install 'snake-robot-env[{extra}]'"
    assert sorted(path.name for path in tmp_path.iterdir()) == given


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command, capsys):
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    assert f"snake-env {command}" in capsys.readouterr().out.replace("python -m snake_env", "snake-env")
