"""What users read when something is not as it should be: names, counts, and what to do."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import warnings
from importlib import import_module
from inspect import signature
from pathlib import Path

import gymnasium as gym
import pytest

import snake_env
from snake_env import ConfigError, Gait, Integrator, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start, _native
from snake_env.options import TaskOptions

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("value", [5, "x", [1, 2], None])
@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("integrator", "a snake_env.Integrator, or a mapping"),
        ("robot", "a snake_env.Robot, or a mapping"),
        ("randomization", "a snake_env.Randomization, or a mapping"),
        ("reward_weights", "a mapping"),
        ("perturbation", "a mapping"),
    ],
)
def test_a_section_of_the_wrong_kind_is_told_its_class(section, words, value):
    with pytest.raises(ConfigError, match=f"^{section} = .*: expected {words} of field names to values$"):
        SnakeVectorEnv(1, **{section: value})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: SnakeVectorEnv(1, task=3), "task = 3: expected one of `course`, `field`,"),
        (lambda: SnakeVectorEnv(1, randomization={"noise": 3}), "randomization.noise = 3: expected a snake_env.Noise"),
        (lambda: SnakeVectorEnv(1, friction=0.2), "friction = 0.2: expected 2 numbers"),
        (lambda: snake_env.simulate(start=Start(position=(1, 2, 3))), "start.position = .*: expected 2 numbers"),
        (
            lambda: snake_env.simulate(start=Start(posture=3)),
            'start.posture = 3: expected "gait", "straight" or a joint',
        ),
        (lambda: snake_env.PD(treatment=[1]), 'controller.treatment = .*: expected "implicit", "step" or a period'),
        (lambda: snake_env.Robot(mass="x"), 'robot.mass = "x": expected a number, or a list of numbers'),
    ],
)
def test_a_value_of_the_wrong_kind_is_told_what_to_write(call, message):
    with pytest.raises(ConfigError, match=message):
        call()


@pytest.mark.parametrize(("name", "value"), [("num_envs", 4), ("num_threads", 1), ("autoreset_mode", "SameStep")])
def test_a_keyword_of_batches_is_told_where_it_belongs(name, value):
    with pytest.raises(ConfigError, match=f"{name} belongs to batches, gymnasium.make_vec; known are ") as caught:
        gym.make("SnakeField-v0", **{name: value})
    known = caught.value.expected.partition("known are ")[2].split(", ")
    taken = [one for one in signature(SnakeEnv).parameters if one != "options"]
    assert sorted(known) == sorted([*TaskOptions.__annotations__, *taken])


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
def test_a_scene_is_told_where_the_pegs_of_an_environment_come_from(make):
    with pytest.raises(ConfigError, match=r"^scene = Scene\(\.\.\.\): expected no scene: .*simulate$") as caught:
        make("SnakeCourse-v0", scene=Scene.preset("table-7.5"))
    named = caught.value.expected.partition("(keywords ")[2].partition(")")[0].replace(" and ", ", ").split(", ")
    assert set(named) < set(TaskOptions.__annotations__)


def test_a_misspelt_keyword_of_batches_is_told_the_nearest():
    with pytest.raises(ConfigError, match=r"num_thread = 1: expected a known keyword, perhaps num_threads; ") as caught:
        gym.make_vec("SnakeField-v0", num_envs=2, num_thread=1)
    known = caught.value.expected.partition("known are ")[2].split(", ")
    taken = [one for one in signature(SnakeVectorEnv).parameters if one != "options"]
    assert sorted(known) == sorted([*TaskOptions.__annotations__, *taken])


@pytest.mark.parametrize(
    ("model", "largest", "words"),
    [
        ("planar", math.pi, r"\[-pi, pi\]"),
        ("minimal", math.pi, r"\[-pi, pi\]"),
        ("spatial", math.nextafter(math.pi / 2, 0.0), r"\(-pi/2, pi/2\)"),
    ],
)
def test_an_offset_too_large_for_any_amplitude_is_named_itself(model, largest, words):
    for gamma in (30, -30, math.nextafter(largest, 4.0), -math.nextafter(largest, 4.0)):
        with pytest.raises(ConfigError, match=rf"^gait\.gamma = {gamma}: expected an angle in {words}, in radians$"):
            snake_env.simulate(model, gait=Gait(gamma=gamma))
    with pytest.raises(ConfigError, match=r"^gait\.amplitude = 0\.69.* with the offset"):
        snake_env.simulate(model, gait=Gait(gamma=largest))
    with pytest.raises(ConfigError, match=r"^duration = 0"):  # which the core checks after the gait
        snake_env.simulate(model, gait=Gait(gamma=largest, amplitude=0.0), duration=0.0)


@pytest.mark.parametrize("wrong", [-1, 2.5, "x", None, True, 10**30])
@pytest.mark.parametrize(
    ("make", "below_or_above"),
    [
        (lambda links: Robot(links=links), [{"robot": {"links": 1}}, {"robot": {"links": 10_001}}]),
        (lambda links: SnakeVectorEnv(1, robot={"links": links}), [{"robot": {"links": 1}}]),
        (lambda pegs: SnakeVectorEnv(1, nearest_pegs=pegs), [{"nearest_pegs": 0}, {"nearest_pegs": 65}]),
        (lambda points: SnakeVectorEnv(1, push_points=points), [{"push_points": 5}]),
    ],
)
def test_what_is_no_count_is_told_the_range_of_the_core(make, below_or_above, wrong):
    with pytest.raises(ConfigError) as told:
        make(wrong)
    for config in below_or_above:
        with pytest.raises(ConfigError) as of_the_core:
            _native.layout(json.dumps(config))
        assert (told.value.field, told.value.expected) == (of_the_core.value.field, of_the_core.value.expected)


def test_without_the_compiled_core_the_import_says_how_to_get_it(tmp_path):
    shutil.copytree(ROOT / "snake_env", tmp_path / "snake_env", ignore=shutil.ignore_patterns("*.so", "*.pyd"))
    command = [sys.executable, "-c", "import snake_env"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "run `make build`" in done.stderr.splitlines()[-1]


def test_missed_solves_are_reported_once_with_their_number_and_a_remedy():
    few = Integrator(method="thesis", max_iterations=2)
    with pytest.warns(UserWarning, match="take a smaller Integrator.step") as caught:
        run = snake_env.simulate(scene=snake_env.Scene.preset("table-7.5"), integrator=few, duration=0.5)
    assert len(caught) == 1
    assert f"{run.misses.sum():.0f} solves gave up" in str(caught[0].message)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert snake_env.simulate(duration=0.5).misses.sum() == 0


def test_the_ray_learner_explains_itself_without_ray(monkeypatch, capsys):
    pytest.importorskip("torch")
    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.delitem(sys.modules, "training.ppo_ray", raising=False)
    ppo_ray = import_module("training.ppo_ray")
    with pytest.raises(SystemExit, match="0"):
        ppo_ray.main(["--help"])
    assert "--workers" in capsys.readouterr().out
    assert ppo_ray.main([]) == 2
    assert "make .venv-ray/.packages" in capsys.readouterr().err


@pytest.mark.parametrize("what", ["option", "networks"])
def test_a_run_that_does_not_fit_says_what_it_was_begun_with(tmp_path, capsys, what):
    pytest.importorskip("torch")
    from training import ppo

    folder = tmp_path / "run"
    arguments = ["--out", str(folder), "--config", "smoke", "--no-bar", "--total-steps", "512"]
    assert ppo.main(arguments) == 0
    config = json.loads((folder / "config.json").read_text())
    config["policy"] |= {"hidden": [7]} if what == "networks" else {"layers": 3}
    (folder / "config.json").write_text(json.dumps(config))
    versions = json.loads((folder / "versions.json").read_text()) | {"snake_env": "0.0.1"}
    (folder / "versions.json").write_text(json.dumps(versions))
    assert ppo.main([*arguments[:2], "--resume", "--total-steps", "1024", "--no-bar"]) == 2
    told = capsys.readouterr().err
    assert f"{folder} does not resume: " in told
    assert ("size mismatch" if what == "networks" else "policy.layers = 3: expected one of hidden, log_std") in told
    assert f"snake_env 0.0.1, now {snake_env.__version__}" in told
    assert os.linesep + "It was begun with" in told


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("benchmark --tasks nowhere", "task = nowhere: expected one of course, "),
        ("benchmark --policies nobody", "policy = nobody: expected one of thesis gait, "),
        ("compare_gaits --env Nowhere-v0", "Environment `Nowhere` doesn't exist"),
        ("difficulty --tasks nowhere", "task = nowhere: expected one of field, "),
        ("evaluate --env CartPole-v1", "env_id = CartPole-v1: expected an id of one of this package's environments"),
        (
            f"evaluate --policy {ROOT}/pretrained/field-hard.safetensors --env CartPole-v1",
            "env_id = CartPole-v1: expected an id of one of this package's environments",
        ),
        ("evaluate --policy nowhere.zip", "policy = nowhere.zip: expected the policy.safetensors or model.zip"),
        ("evaluate --gait 300,120,-50", "gait = A 300, omega 120, beta -50 deg: expected values the environment can"),
        ("inspect_policy --policy nowhere", "policy = nowhere: expected the policy.safetensors or model.zip"),
        ("learners --config nowhere", "config = nowhere: expected a YAML or JSON file, or a name"),
        ("pipeline --config nowhere", "config = nowhere: expected a YAML or JSON file, or a name"),
        ("tune --controllers nobody", "policy = nobody: expected one of best gait, "),
    ],
)
def test_a_name_that_does_not_exist_ends_a_command_with_one_line(capsys, command, told):
    pytest.importorskip("torch")
    module, *arguments = command.split()
    with pytest.raises(SystemExit, match="2"):
        import_module(f"training.{module}").main(arguments)
    assert told in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize("learner", ["ppo", "train", "evolution", "pipeline", "sweep"])
@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        ("cut.json", '{"ppo": {"gamma": 0.9', "cut.json: expected JSON (Expecting"),
        ("cut.yaml", "ppo: {gamma: 0.9", "cut.yaml: expected YAML (while parsing a flow mapping"),
        ("bytes.yaml", b"\xff\x00", "bytes.yaml: expected YAML ('utf-8' codec can't decode"),
        ("list.json", "[1, 2]", "list.json: expected a mapping of names to values"),
        ("section.json", '{"ppo": 3}', "ppo = 3: expected a mapping of names to values"),
        (
            "river.json",
            '{"env_id": "SnakeRiver-v0"}',
            "env_id = SnakeRiver-v0: expected an id of one of this package's",
        ),
    ],
)
def test_a_broken_configuration_ends_a_command_with_one_line(tmp_path, capsys, learner, file, content, told):
    pytest.importorskip("torch")
    if learner in ("train", "pipeline"):
        pytest.importorskip("stable_baselines3")
    path = tmp_path / file
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    given = "--configs" if learner == "sweep" else "--config"
    try:
        status = import_module(f"training.{learner}").main([given, str(path), "--out", str(tmp_path / "run")])
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert told in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "run").exists(), "the folder is left free"
