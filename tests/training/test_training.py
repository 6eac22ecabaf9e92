"""Training keeps what it has learnt, evaluation is fair and says how sure it is."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from tensorboard.backend.event_processing import event_accumulator

from snake_env import ConfigError
from snake_env.evaluation import rollout, scores, seeds, statistics
from snake_env.policies import DEGREE, GaitParameters, GaitPolicy
from training import cli, config, evaluate, pace, pipeline, runs, train
from training.evaluation import cached_scores, loading
from training.learners import sb3
from training.search import compare_gaits, gait_search
from training.search.optimise import Plan

SMOKE = ["--config", "smoke", "--no-bar"]


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A finished run of 4096 steps."""
    out = tmp_path_factory.mktemp("run")
    assert train.main(["--out", str(out), *SMOKE]) == 0
    return runs.RunFolder(out)


def test_a_run_leaves_everything_needed_to_judge_it(trained):
    assert trained.finished
    assert trained.config() == config.load("smoke")
    assert json.loads((trained.path / "versions.json").read_text())["stable_baselines3"]
    assert list((trained.path / "tensorboard").glob("events*"))
    curve = trained.read_curve()
    assert [row["steps"] for row in curve] == list(range(256, 4097, 256))
    assert {"return", "is_success", "distance"} <= set(curve[-1])


def test_checkpoints_are_kept_in_small_number(trained):
    kept = sorted(path.name for path in trained.checkpoints.iterdir())
    assert len(kept) <= 3
    assert kept[-1] == "000004096.zip"


@pytest.mark.parametrize("learner", ["sb3", "ppo"])
def test_a_run_is_resumed_from_the_latest_checkpoint_and_not_overwritten(learner, tmp_path, capsys):
    out = tmp_path / "run"
    arguments = ["--learner", learner, "--out", str(out)]
    assert train.main([*arguments, *SMOKE, "--total-steps", "1024"]) == 0
    assert train.main([*arguments, "--resume", "--no-bar", "--total-steps", "2048"]) == 0
    folder = runs.RunFolder(out)
    steps = [row["steps"] for row in folder.read_curve()]
    assert steps == list(range(256, 2049, 256))
    seconds = [row["seconds"] for row in folder.read_curve()]
    assert seconds == sorted(seconds)
    assert folder.latest().stem == "000002048"
    assert train.main([*arguments, *SMOKE]) == 2
    assert "--resume" in capsys.readouterr().err


def wait_for_checkpoint(folder, seconds=120):
    end = time.monotonic() + seconds
    while folder.latest() is None and time.monotonic() < end:
        time.sleep(0.05)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "terminate"])
def test_a_stopped_run_is_saved_and_resumes(tmp_path, number, capsys):
    folder = runs.RunFolder(tmp_path / "run")

    def stop():
        wait_for_checkpoint(folder)
        os.kill(os.getpid(), number)

    user = threading.Thread(target=stop)
    user.start()
    assert train.main(["--out", str(folder.path), *SMOKE, "--total-steps", "100000000"]) == 130
    user.join()
    assert "--resume" in capsys.readouterr().out
    steps = int(folder.latest().stem)
    assert steps > 0
    assert not folder.finished
    assert train.main(["--out", str(folder.path), "--resume", "--no-bar", "--total-steps", str(steps + 256)]) == 0
    assert folder.finished


def test_a_killed_run_leaves_whole_checkpoints(tmp_path):
    folder = runs.RunFolder(tmp_path / "run")
    command = [
        sys.executable,
        "-m",
        "training",
        "train",
        "--out",
        str(folder.path),
        *SMOKE,
        "--total-steps",
        "100000000",
    ]
    process = subprocess.Popen(command)
    wait_for_checkpoint(folder)
    process.kill()
    process.wait()
    steps = int(folder.latest().stem)
    assert train.main(["--out", str(folder.path), "--resume", "--no-bar", "--total-steps", str(steps + 256)]) == 0


def test_a_run_that_was_stopped_ends_as_one_that_was_not(trained, tmp_path):
    """Stopped after a third: networks, optimiser, robots and random states go on bit for bit."""
    folder = runs.RunFolder(tmp_path / "run")

    def stop():
        wait_for_checkpoint(folder)
        os.kill(os.getpid(), signal.SIGINT)

    user = threading.Thread(target=stop)
    user.start()
    assert train.main(["--out", str(folder.path), *SMOKE]) == 130
    user.join()
    assert 0 < int(folder.latest().stem) < 4096
    assert train.main(["--out", str(folder.path), "--resume", "--no-bar"]) == 0
    whole, parts = (PPO.load(one.policy).policy.state_dict() for one in (trained, folder))
    assert all(torch.equal(values, parts[name]) for name, values in whole.items())
    timing = ("seconds", "steps_per_second")
    for first, second in zip(trained.read_curve(), folder.read_curve(), strict=True):
        assert {key: first[key] for key in first if key not in timing} == {
            key: second[key] for key in second if key not in timing
        }


def test_a_run_records_its_diagnostics(trained):
    """TensorBoard has what shows whether PPO is healthy, and the evaluations."""
    found = scalars(trained.path)
    assert {"train/loss", "train/approx_kl", "train/clip_fraction", "train/explained_variance"} <= set(found)
    assert {"train/entropy_loss", "train/learning_rate", "time/fps", "snake/is_success"} <= set(found)
    assert [one.step for one in found["eval/is_success"]] == [2048, 4096]
    assert trained.best.exists()


def scalars(path):
    accumulator = event_accumulator.EventAccumulator(str(path / "tensorboard"))
    accumulator.Reload()
    return {name: accumulator.Scalars(name) for name in accumulator.Tags()["scalars"]}


def test_fields_for_training_choosing_and_judging_never_meet():
    ranges = [seeds.TRAINING, seeds.SELECTION, seeds.HELD_OUT]
    for first, second in pairwise(ranges):
        assert first.stop <= second.start
    assert all(seed in seeds.HELD_OUT for seed in seeds.held_out(200))
    for seed, steps in ((0, 0), (2**31 - 1, 10**9), (7, 123_456)):
        first = seeds.training(seed, steps, 128)
        assert seeds.TRAINING.start <= first
        assert first + 128 <= seeds.TRAINING.stop


@pytest.mark.parametrize("count", [0, -1, 2**31 + 1, 2.0, True])
def test_only_as_many_fields_as_there_are_can_be_had(count):
    for choose in (seeds.held_out, seeds.selection):
        with pytest.raises(ConfigError, match=rf"count = {count}: expected an integer in \[1, 2147483648\]"):
            choose(count)
    with pytest.raises(ConfigError, match=r"count = 2: expected an integer in \[1, 1\]"):
        seeds.selection(2, 2**31 - 1)
    with pytest.raises(ConfigError, match=r"skip = -1: expected an integer in"):
        seeds.selection(1, -1)


def test_held_out_seeds_reach_the_environment():
    """The same seed gives the same field to every policy; another seed another one."""
    env = rollout.make_env("SnakeField-v1", 3, 1)
    first, second = seeds.held_out(2)
    observation, _ = env.reset(seed=[first, second, first])
    assert np.array_equal(observation[0], observation[2])
    assert not np.array_equal(observation[0], observation[1])
    env.close()


def test_evaluation_prints_a_table_and_writes_json(trained, tmp_path, capsys):
    arguments = ["--model", str(trained.policy), "--gait", "thesis", "--gait", "30,120,-50", "--fields", "4"]
    options = ["--options", '{"max_episode_steps": 20}', "--out", str(tmp_path), "--video"]
    assert evaluate.main([*arguments, *options]) == 0
    text = capsys.readouterr().out
    for word in (
        "success",
        "progress [m]",
        "jam_ratio",
        "cost_of_transport",
        "thesis gait",
        "A 30, omega 120, beta -50",
    ):
        assert word in text
    content = json.loads((tmp_path / "evaluation.json").read_text())
    assert set(content["scores"]) == {"thesis gait", "A 30, omega 120, beta -50 deg", trained.path.name}
    speed = content["scores"]["thesis gait"]["speed"]
    assert speed["low"] <= speed["value"] <= speed["high"]
    assert [path for path in tmp_path.iterdir() if path.suffix in (".mp4", ".gif")]


def test_policies_of_one_name_are_distinguished_by_their_paths(tmp_path):
    paths = [tmp_path / folder / "seed-0" / "policy.safetensors" for folder in ("one", "two")]
    for path in paths:
        path.parent.mkdir(parents=True)
        shutil.copy(cached_scores.ROOT / "snake_env/policies/shipped/field-hard.safetensors", path)
    assert [policy.name for policy in loading.load_models(paths)] == [str(path) for path in paths]
    assert [policy.name for policy in loading.load_models(paths[:1])] == ["seed-0"]


def test_what_a_policy_brings_along_cannot_be_asked_for_otherwise(tmp_path, capsys):
    path = str(cached_scores.ROOT / "snake_env/policies/shipped/field-hard.safetensors")
    arguments = ["--policy", path, "--fields", "2", "--out", str(tmp_path)]
    assert evaluate.main([*arguments, "--options", '{"perception": "blind"}']) == 2
    assert "options.perception = blind: expected body, which field-hard acts with" in capsys.readouterr().err


@pytest.mark.parametrize("where", [["--options", '{"model": "spatial"}'], ["--env", "SnakeSpatial-v1"]])
def test_a_policy_of_the_plane_does_not_play_in_space(where, tmp_path, capsys):
    path = str(cached_scores.ROOT / "snake_env/policies/shipped/field-hard.safetensors")
    assert evaluate.main(["--policy", path, "--fields", "1", "--out", str(tmp_path), *where]) == 2
    assert f"model = spatial: expected planar, which {path} was trained in; --env and" in capsys.readouterr().err


def test_a_gait_plays_in_space_without_a_vertical_wave(tmp_path):
    options = ["--options", '{"model": "spatial", "max_episode_steps": 2}', "--num-threads", "1"]
    assert evaluate.main(["--gait", "30,120,-50", "--fields", "1", "--out", str(tmp_path), *options]) == 0
    entries = rollout.layout_of("SnakeField-v1", {"model": "spatial", "action_mode": "gait"})["action"]
    low, high = (np.array([entry[end] for entry in entries]) for end in ("low", "high"))
    gait = GaitParameters(30 * DEGREE, 120 * DEGREE, -50 * DEGREE)
    commanded = low + 0.5 * (gait.action(entries) + 1.0) * (high - low)
    assert entries[4]["name"] == "lift"
    np.testing.assert_allclose(np.degrees(commanded), [30.0, 120.0, -50.0, 0.0, 0.0, 0.0], atol=1e-4)
    rolling = GaitParameters(10 * DEGREE, 200 * DEGREE, 0.0, 2 * DEGREE, 10 * DEGREE, 90 * DEGREE)
    assert str(rolling) == "A 10, omega 200, beta 0, gamma 2.0, lift 10 at 90 deg"
    entries = rollout.layout_of("SnakeSpatial-v1", {"action_mode": "gait"})["action"]
    low, high = (np.array([entry[end] for entry in entries]) for end in ("low", "high"))
    commanded = low + 0.5 * (rolling.action(entries) + 1.0) * (high - low)
    np.testing.assert_allclose(np.degrees(commanded), [10.0, 200.0, 0.0, 2.0, 10.0, 90.0], atol=1e-4)
    assert gait_search.ranges_of(entries) == gait_search.SPATIAL_RANGES
    with pytest.raises(ConfigError, match=r"without a vertical wave"):
        rolling.action(rollout.layout_of("SnakeField-v1", {"action_mode": "gait"})["action"])


def test_evaluation_repeats_itself_whatever_the_threads():
    gait = GaitPolicy(GaitParameters())
    first = rollout.run_episodes(gait, "SnakeField-v1", seeds.held_out(6), 1, max_episode_steps=30)
    second = rollout.run_episodes(gait, "SnakeField-v1", seeds.held_out(6), 2, max_episode_steps=30)
    for name, values in first.items():
        assert np.array_equal(values, second[name]), name


def test_an_episode_counts_its_first_end_only():
    gait = GaitPolicy(GaitParameters())
    short = rollout.run_episodes(gait, "SnakeField-v1", seeds.held_out(3), 1, max_episode_steps=10)
    assert np.all(short["time"] <= 0.5 + 1e-9)


def test_the_thesis_gait_is_action_zero_and_gaits_out_of_reach_are_refused():
    env = rollout.make_env("SnakeField-v1", 1, action_mode="gait")
    entries = env.unwrapped.layout["action"]
    np.testing.assert_allclose(GaitParameters().action(entries), 0.0, atol=1e-7)
    with pytest.raises(ValueError, match="omega 9999"):
        GaitParameters(omega=9999 * DEGREE).action(entries)
    env.close()


def test_the_search_finds_the_faster_gait_on_open_ground(tmp_path, monkeypatch):
    """Without pegs on orthotropic ground a wave twice as fast gets further."""
    monkeypatch.setattr(compare_gaits, "PLAN", Plan(3, 8, 1, 2, 1))
    ranges = ["--amplitude", "40", "40", "--omega", "80", "160", "--beta", "-50", "-50"]
    arguments = ["gaits", "--env", "SnakeFree-v1", *ranges]
    options = ["--fields", "2", "--options", '{"max_episode_steps": 60}', "--out", str(tmp_path)]
    assert cli.main([*arguments, *options]) == 0
    content = json.loads((tmp_path / "gaits.json").read_text())
    assert content["best"]["omega"] > 140.0
    assert content["gaits"][0]["omega"] == 80.0, "the thesis's gait is tried first"
    assert (tmp_path / "gaits.png").stat().st_size > 5000


def test_the_pipeline_makes_every_file_and_repeats_no_finished_stage(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, "PLAN", Plan(1, 2, 1, 1, 1))
    arguments = ["pipeline", "--out", str(tmp_path), "--config", "smoke", "--fields", "3"]
    assert cli.main(arguments) == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert {"evaluation.json", "learning-curve.png", "comparison.png", "paths.png", "gaits", "policy"} <= names
    assert names & {"policy.mp4", "policy.gif"}
    before = (tmp_path / "policy" / "model.zip").stat().st_mtime_ns
    assert cli.main(arguments) == 0
    assert (tmp_path / "policy" / "model.zip").stat().st_mtime_ns == before
    assert "starting over" not in capsys.readouterr().out
    assert cli.main([*arguments, "--seed", "5"]) == 0
    assert "starting over" in capsys.readouterr().out


def test_the_pipeline_plays_the_policy_that_was_best_in_an_evaluation(tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, "PLAN", Plan(1, 2, 1, 1, 1))
    played = []
    monkeypatch.setattr(pipeline, "load_policy", lambda path, name: played.append(path.name) or GaitPolicy(name=name))
    arguments = ["pipeline", "--out", str(tmp_path), "--config", "smoke", "--fields", "3"]
    assert cli.main(arguments) == 0
    (tmp_path / "policy" / "best.zip").unlink()  # as in a run without evaluations
    assert cli.main(arguments) == 0
    assert played == ["best.zip", "model.zip"]


def test_the_pipeline_trains_on_for_more_steps_and_refuses_fewer(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, "PLAN", Plan(1, 2, 1, 1, 1))
    monkeypatch.setattr(pipeline, "_evaluation_stage", lambda *_: None)
    arguments = ["pipeline", "--out", str(tmp_path), "--config", "smoke", "--total-steps"]
    folder = runs.RunFolder(tmp_path / "policy")
    for steps in (256, 512):
        assert cli.main([*arguments, str(steps)]) == 0
        assert PPO.load(folder.policy, device="cpu").num_timesteps == folder.config().total_steps == steps
    assert "resuming after 256 steps" in capsys.readouterr().out
    assert cli.main([*arguments, "256"]) == 2
    assert "total_steps = 256: expected at least 512, which " in capsys.readouterr().err
    assert folder.config().total_steps == 512


def test_progress_output_does_not_change_a_run_of_the_pipeline(tmp_path):
    smoke = config.load("smoke")
    folder = runs.RunFolder(tmp_path)
    folder.create(smoke)
    assert pipeline._holds(folder, smoke.with_changes(about="in other words", total_steps=512))
    assert not pipeline._holds(folder, smoke.with_changes(seed=5))
    assert not pipeline._holds(folder, config.load("smoke", "ppo"))


@pytest.mark.parametrize("stage", ["search", "train", "run_episodes"])
def test_the_pipeline_stopped_in_any_stage_goes_on(stage, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, "PLAN", Plan(1, 2, 1, 1, 1))
    monkeypatch.setattr(pace, "IN_A_FILE", 0.0)
    arguments = ["pipeline", "--out", str(tmp_path), "--config", "smoke", "--fields", "3"]

    def stop(*_, **__):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60.0)

    with monkeypatch.context() as patch:
        place = {"search": gait_search, "train": sb3, "run_episodes": pipeline}[stage]
        patch.setattr(place, stage, stop)
        assert cli.main(arguments) == 130
    assert capsys.readouterr().out.splitlines()[-1] == "stopped; the same command continues"
    assert cli.main(arguments) == 0
    told = capsys.readouterr().out
    assert "starting over" not in told
    searched = "batch 1 of 1: 2 candidates on 1 fields each\n1 control periods\n" in told
    assert searched == (stage == "search"), "finished stages are not repeated"


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_option_has_a_help_text(command, capsys):
    with pytest.raises(SystemExit, match="0"):
        cli.main([command, "--help"])
    options = re.split(r"\n\W*--", re.sub(r"[│╭╮╰╯─]", " ", capsys.readouterr().out))[1:]
    assert options
    for option in options:
        described = re.sub(r"\(default:.*?\)", "", " ".join(option.split()), count=1)
        assert len(described.split()) > 2, option


def test_the_curve_has_no_steps_that_were_undone(tmp_path):
    folder = runs.RunFolder(tmp_path)
    for steps in (100, 200, 300, 200, 400):
        folder.append_curve({"steps": steps})
    assert [row["steps"] for row in folder.read_curve()] == [100, 200, 400]


def test_bootstrap_intervals_cover_the_truth_as_often_as_they_say():
    """300 samples of 60 exponential variables of mean 1: coverage 95 % less the known undercoverage of a skewed
    distribution (about 2 %), within three standard errors of a proportion from 300 trials (3.8 %)."""
    rng = np.random.default_rng(1)
    intervals = [statistics.bootstrap(np.mean, rng.exponential(size=60), resamples=400) for _ in range(300)]
    covered = np.mean([one.low <= 1.0 <= one.high for one in intervals])
    assert 0.89 <= covered <= 0.985


def test_bootstrap_width_is_that_of_the_normal_law():
    """Of a mean of 400 normal variables: 2 * 1.96 / 20, within sampling errors of a few per cent."""
    one = statistics.mean_interval(np.random.default_rng(2).normal(size=400))
    assert one.high - one.low == pytest.approx(2 * 1.96 / 20, rel=0.12)


def test_statistics_of_few_or_no_episodes():
    assert np.isnan(statistics.mean_interval(np.array([])).value)
    assert statistics.mean_interval(np.array([3.0])) == (3.0, 3.0, 3.0)
    assert statistics.ratio_interval(np.ones(4), np.full(4, 2.0)) == (0.5, 0.5, 0.5)
    assert statistics.ratio_interval(np.ones(4), -np.ones(4)).value == np.inf
    assert statistics.paired_difference(np.array([1.0, 2.0]), np.array([0.0, 1.0])) == (1.0, 1.0, 1.0)


def test_student_interval_of_three_values():
    """Values 1, 2 and 3: mean 2, standard error 1 / sqrt 3, and 4.303 of these to either side."""
    assert statistics.student_interval([1.0, 2.0, 3.0]) == pytest.approx((2.0, -0.484, 4.484), abs=1e-3)
    assert np.isnan(statistics.student_interval([1.0]).low)
    rates = statistics.student_interval([1.0, 1.0, 0.9], least=0.0, most=1.0)
    assert (rates.high, rates.low < 0.9) == (1.0, True), "no rate of success is above one"


def test_aggregates_are_those_of_rliable():
    """Against their definitions written out; the values of two tasks count together."""
    scores = [0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 70.0]
    middle = statistics.interquartile_mean(*scores)
    assert middle.value == np.mean([2.0, 3.0, 4.0, 5.0])
    assert middle.low < middle.value < middle.high
    better = statistics.probability_of_improvement([[1.0, 2.0, 2.0]], [[0.0, 2.0]])
    assert better.value == pytest.approx((1.0 + 0.0 + 1.0 + 0.5 + 1.0 + 0.5) / 6.0)
    assert 0.0 <= better.low <= better.high <= 1.0
    in_two = statistics.probability_of_improvement([[1.0, 2.0, 2.0], [3.0]], [[0.0, 2.0], [1.0, 2.0, 4.0]])
    assert in_two.value == pytest.approx(0.5 * (4.0 / 6.0 + 2.0 / 3.0))


def test_scores_have_no_times_where_no_goal_was_reached():
    episodes = {
        "is_success": np.zeros(3, bool),
        "time": np.full(3, 30.0),
        "distance": np.array([0.1, 0.2, 0.3]),
        "speed": np.full(3, 0.01),
        "jam_ratio": np.zeros(3),
        "mean_self_contact_force": np.zeros(3),
        "cost_of_transport": np.full(3, 2.0),
        "left_corridor": np.zeros(3, bool),
        "contact_free_progress": np.zeros(3),
        "chatter": np.zeros(3),
    }
    row = scores.score(episodes)
    assert scores.plain(row)["time_to_goal"]["value"] is None
    assert row["cost_of_transport"].value == pytest.approx(2.0)
    assert scores.table({"none": row}).splitlines()[1].endswith("  -")


def test_no_figure_needs_a_display():
    code = (
        "import training.evaluation.figures, snake_env.reproduce.figures, matplotlib; print(matplotlib.get_backend())"
    )
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    done = subprocess.run([sys.executable, "-c", code], check=True, env=environment, capture_output=True, text=True)
    assert done.stdout.strip().lower() == "agg"
