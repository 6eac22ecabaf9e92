"""Entries of the benchmark are replayed, run no code, and are ranked over runs."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from snake_env import ConfigError
from snake_env.policies import files
from snake_env.policies.shipped import policy_path
from training import cli, config
from training.submission import ancestry, entry, leaderboard, play, verify

SHORT = ["--tasks", "course", "maze", "--episodes", "4", "--num-threads", "1"]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def submit(name, *arguments):
    assert cli.main(["submit", "--out", f"entries/{name}", *SHORT, *arguments]) == 0
    return entry.read(entry.Path(f"entries/{name}"))


def changed(name, **values):
    """Another entry of this name, which need not be admissible."""
    path = entry.Path(f"entries/{name}/entry.json")
    path.write_text(json.dumps(json.loads(path.read_text()) | values))
    return path.parent


def test_an_entry_holds_when_it_is_replayed_and_not_when_its_scores_are_made_up(capsys):
    found = submit("gait", "--policy", "gait", "--block", "joint_angle")
    assert (found.track, found.blocks, found.robot_class) == ("proprioception", ("joint_angle",), "ideal")
    assert found.runs[0].steps == 0
    assert cli.main(["verify", "entries/gait", "--episodes", "4", "--num-threads", "1"]) == 0
    runs = json.loads(found.model_dump_json())["runs"]
    assert runs[0]["scores"]["maze"]["success"] < 0.6
    runs[0]["scores"]["course"]["speed"] *= 1.1
    changed("gait", runs=runs)
    assert cli.main(["verify", "entries/gait", "--episodes", "4", "--num-threads", "1"]) == 1
    assert "1 of 2 do not hold" in capsys.readouterr().out


def test_replays_are_on_other_scenes_of_the_same_length(monkeypatch):
    submit("gait", "--policy", "gait")
    firsts = []
    episodes = play.episodes
    monkeypatch.setattr(play, "episodes", lambda *given: firsts.append(given[3:5]) or episodes(*given))
    assert cli.main(["verify", "entries/gait", "--episodes", "3", "--num-threads", "1"]) == 0
    assert firsts == [(3, 4), (3, 4)]


def test_chance_is_told_from_a_difference():
    """30 of 100 and 60 of 100 successes differ, 30 and 33 do not; so for speeds by their standard errors."""
    score = entry.Scores(success=0.3, speed=0.2, speed_deviation=0.1, score=0.1, cost_of_transport=None, failed=0)
    same = verify.chances(score, 100, score.with_changes(success=0.33, speed=0.21), 100)
    assert min(same) > 0.1
    other = verify.chances(score, 100, score.with_changes(success=0.6, speed=0.25), 100)
    assert max(other) < 1e-3
    still = score.with_changes(speed_deviation=0.0)
    assert verify.chances(still, 100, still, 100) == (1.0, 1.0)
    assert verify.chances(still, 100, still.with_changes(speed=0.3), 100)[1] == 0.0


def test_an_entry_observes_what_its_track_admits_and_no_more(capsys):
    assert cli.main(["submit", "--out", "entries/general", *SHORT, "--policy", "general", "--track", "touch"]) == 2
    assert "observation_blocks = velocity: expected blocks of the track touch: " in capsys.readouterr().err
    assert not entry.Path("entries").exists()
    submit("gait", "--policy", "gait")
    with pytest.raises(ConfigError, match=r"^observation_blocks = .*: expected blocks of the track touch"):
        entry.read(changed("gait", track="touch"))
    submit("gait", "--policy", "gait", "--block", "joint_angle", "--block", "velocity")
    assert cli.main(["verify", str(changed("gait", track="touch", blocks=["joint_angle"]))]) == 2, "it observes more"


@pytest.mark.parametrize(
    "policy", ["os:system", "../run-0.safetensors", "/etc/passwd", "model.zip", "net.pt", "absent"]
)
def test_an_entry_names_no_policy_that_could_run_code(policy):
    folder = entry.Path("entries/gait")
    runs = json.loads(submit("gait", "--policy", "gait").model_dump_json())["runs"]
    for name in ("model.zip", "net.pt"):
        (folder / name).write_bytes(b"")
    shutil.copy(policy_path("thrifty"), folder.parent / "run-0.safetensors")
    with pytest.raises(ConfigError, match=r"^policy = .*: expected a shipped or scripted policy, or a file of"):
        entry.read(changed("gait", runs=[runs[0] | {"policy": policy}]))


def test_a_copied_policy_is_the_policy():
    found = submit("copied", "--policy", str(policy_path("field-hard")))
    assert found.runs[0].policy == "run-0.safetensors"
    shipped = submit("shipped", "--policy", "field-hard")
    assert found.runs[0].scores == shipped.runs[0].scores
    assert found.runs[0].steps == shipped.runs[0].steps == files.read(policy_path("field-hard"))[1]["steps"]


@pytest.mark.parametrize("learner", ["sb3", "ppo"])
def test_runs_are_entered_with_seed_steps_and_time(learner, tmp_path):
    pytest.importorskip("stable_baselines3")
    blocks = '{"observation_blocks": ["joint_angle", "heading", "wave"]}'
    for seed in range(2):
        command = ["train", "--config", "smoke", "--no-bar", "--learner", learner, "--seed", str(seed), "--env", blocks]
        assert cli.main([*command, "--total-steps", "256", "--out", f"runs/{seed}"]) == 0
    found = submit("mine", "--policy", "runs/0", "--policy", "runs/1", "--track", "proprioception")
    assert [(run.policy, run.seed, run.steps) for run in found.runs] == [
        ("run-0.safetensors", 0, 256),
        ("run-1.safetensors", 1, 256),
    ]
    assert all(run.seconds is not None and run.machine["torch"] for run in found.runs)
    shutil.rmtree("runs")
    assert cli.main(["verify", "entries/mine", "--episodes", "2", "--tasks", "maze", "--num-threads", "1"]) == 0


def test_steps_count_everything_that_a_policy_builds_on_once():
    """`general` comes from perturbed courses, and imitates the policies for them, for hard fields and for corridors."""

    def own(name):
        return files.read(policy_path(name))[1]

    cloned = config.load("perturbed-cloned").total_steps
    expected = cloned + sum(own(name)["steps"] for name in ("general", "perturbed", "field-hard", "corridor"))
    assert ancestry.steps(own("general")) == expected > 150e6
    assert ancestry.steps(own("field-hard")) == own("field-hard")["steps"]
    assert ancestry.steps({"steps": 5, "behaviour_cloning": {"policy": "lost.safetensors"}}) is None


def test_scripted_controllers_play_where_they_are_tuned():
    assert cli.main(["submit", "--out", "entries/reflex", "--policy", "contact-reflex", "--episodes", "1"]) == 0
    found = entry.read(entry.Path("entries/reflex"))
    assert "maze" in found.tasks
    assert "course" not in found.tasks


def test_the_leaderboard_ranks_by_the_score_over_runs():
    """Three runs with scores 0.1, 0.2 and 0.3 in one task and the same in the other: their middle is 0.2."""
    submit("slow", "--policy", "gait", "--block", "joint_angle")
    found = submit("fast", "--policy", "gait", "--block", "joint_angle")
    runs = [json.loads(run.model_dump_json()) for run in found.runs * 3]
    for run, score in zip(runs, (0.1, 0.2, 0.3), strict=True):
        of_run = {"score": score, "success": 2.0 * score, "contact_free": score, "chatter": None}
        run["scores"] = {task: run["scores"][task] | of_run for task in found.tasks}
    changed("fast", runs=runs, about="three")
    text = leaderboard.page(leaderboard.entries(entry.Path("entries")))
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows] == ["fast", "slow"]
    assert "| 3 | 4 | 0.0 | 0.200 [0.1" in rows[0]
    assert "| 0.400 [0.000, 0.897] |" in rows[0], "the mean over runs with Student's interval"
    assert rows[0].endswith("| 0.200 | - |"), "what one run lacks is not averaged"
    assert "[" not in rows[1], "one run has no interval over runs"
    assert "## ideal, planar" in text
    assert "cost of transport 0.200" in text


def test_the_page_shows_the_entries_of_the_repository():
    found = leaderboard.entries(leaderboard.FOLDER)
    assert len(found) >= 10
    assert leaderboard.PAGE.read_text() == leaderboard.page(found)


def test_an_entry_says_what_its_policies_are_and_how_they_fare():
    episodes = {
        "is_success": np.array([True, False]),
        "speed": np.array([0.2, 0.1]),
        "distance": np.array([2.0, 1.0]),
        "cost_of_transport": np.array([1.0, 4.0]),
        "contact_free_progress": np.array([0.5, 0.25]),
        "chatter": np.array([0.1, 0.3]),
        **{name: np.zeros(2) for name in ("time", "jam_ratio", "mean_self_contact_force", "left_corridor")},
        **{name: np.zeros(2, np.bool_) for name in ("diverged", "penetrated")},
    }
    found = play.summary(episodes)
    assert (found.success, found.speed, found.score) == pytest.approx((0.5, 0.15, 0.1))
    assert (found.cost_of_transport, found.contact_free, found.chatter) == pytest.approx((2.0, 0.25, 0.2))
    backwards = play.summary(episodes | {"distance": np.array([-2.0, -1.0])})
    assert backwards.cost_of_transport is backwards.contact_free is None
    slid_back = play.summary(episodes | {"contact_free_progress": np.array([-0.5, 0.25])})
    assert slid_back.contact_free is None, "less than nothing is no share"
