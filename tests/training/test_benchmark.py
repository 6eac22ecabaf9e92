"""The benchmark is fair, repeats itself, goes on after a stop, and knows what cannot be beaten."""

import itertools
import json

import numpy as np
import pytest

from snake_env import ConfigError, Scene
from snake_env.evaluation import rollout, seeds, tasks
from snake_env.policies import interface
from snake_env.policies.gaits import DEGREE, GaitParameters
from training.evaluation import benchmark, benchmark_page, cached_scores, over_all_tasks, reference_limits

FREE = tasks.BenchmarkTask("free", "SnakeFree-v1", {"max_episode_steps": 40}, "open ground, for tests")
FIELD = tasks.BenchmarkTask("field", "SnakeField-v1", {"max_episode_steps": 40}, "short fields, for tests")


@pytest.fixture
def small(monkeypatch):
    """Two short tasks and no trained policy."""
    monkeypatch.setattr(tasks, "chosen", lambda names: [FREE, FIELD])
    tuned = {"amplitude": 45 * DEGREE, "omega": 110 * DEGREE, "beta": -50 * DEGREE, "steering": 0.3, "look_ahead": 1.0}
    table = {name: {"heading control": {"values": tuned}} for name in ("free", "field")}
    monkeypatch.setattr(cached_scores.catalogue, "read", lambda path=None: table)
    return ["--policies", "thesis gait", "heading control", "--episodes", "6", "--num-threads", "1"]


def test_two_runs_are_equal_bit_for_bit(small, tmp_path):
    for name in ("first", "second"):
        assert benchmark.main([*small, "--out", str(tmp_path / name)]) == 0
    written = sorted(path.relative_to(tmp_path / "first") for path in (tmp_path / "first").glob("*.*"))
    assert len(written) == 2 + 3, "JSON and Markdown, a picture per task and one over all"
    for path in written:
        assert (tmp_path / "first" / path).read_bytes() == (tmp_path / "second" / path).read_bytes(), path


def test_what_has_been_played_is_not_played_again(small, tmp_path, monkeypatch, capsys):
    played = []
    play = rollout.run_episodes

    def interrupted(policy, env_id, *rest, **options):
        if len(played) == 2:
            raise KeyboardInterrupt
        played.append((env_id, policy.name))
        return play(policy, env_id, *rest, **options)

    monkeypatch.setattr(rollout, "run_episodes", interrupted)
    assert benchmark.main([*small, "--out", str(tmp_path)]) == 130
    assert "the same command continues" in capsys.readouterr().out
    played.clear()
    assert benchmark.main([*small, "--out", str(tmp_path)]) == 0
    assert played == [("SnakeField-v1", "thesis gait"), ("SnakeField-v1", "heading control")]


def test_cached_episodes_belong_to_task_fields_and_code(tmp_path, monkeypatch):
    played = []
    play = rollout.run_episodes
    monkeypatch.setattr(rollout, "run_episodes", lambda *given, **options: played.append(1) or play(*given, **options))
    entry, fields = cached_scores.scripted("thesis gait"), seeds.held_out(2)
    harder = tasks.BenchmarkTask("field", "SnakeField-v1", {"difficulty": 1.0, "max_episode_steps": 40}, "")
    for task, some in ((FIELD, fields), (FIELD, fields), (harder, fields), (FIELD, fields[:1])):
        cached_scores.scores(tmp_path, task, entry, some, 1)
    assert len(played) == 3
    code = cached_scores.sources()
    played_by = ("snake_env/vector_env.py", "snake_env/registration.py", "snake_env/config/robot.py")
    assert {cached_scores.ROOT / one for one in (*played_by, "snake_env/policies/network.py")} <= set(code)
    changed = tmp_path / "vector_env.py"
    changed.write_text("another")
    monkeypatch.setattr(cached_scores, "sources", lambda: [changed, *code])
    cached_scores.scores(tmp_path, FIELD, entry, fields, 1)
    assert len(played) == 4


def test_fields_are_held_out():
    assert seeds.require_held_out(seeds.held_out(500)) is None
    for other in (seeds.TRAINING.start, seeds.SELECTION.start, seeds.TRAINING.stop):
        with pytest.raises(ValueError, match=f"seed = {other}: expected a held-out one"):
            benchmark.Benchmark(None, [*seeds.held_out(2), other])


def test_a_policy_chooses_its_interface_and_not_the_task():
    """A policy trained on easy fields is judged on the task's."""
    trained_with = {"difficulty": 0.0, "perception": "blind", "start_jitter": 0.0}
    assert interface(trained_with) == {"perception": "blind"}


def test_scripted_controllers_play_where_they_are_tuned(monkeypatch):
    monkeypatch.setattr(cached_scores.catalogue, "read", lambda path=None: {"field": {"best gait": {}}})
    assert cached_scores.scripted("best gait").plays(FIELD)
    assert not cached_scores.scripted("best gait").plays(FREE)
    assert cached_scores.scripted("thesis gait").plays(FREE)


def test_configured_policies_exist_and_name_known_tasks():
    content = json.loads(cached_scores.CONFIG.read_text())
    for one in content["trained"]:
        assert (cached_scores.ROOT / one["path"]).exists()
        assert set(one.get("tasks", ())) <= set(tasks.load())


def test_the_page_quotes_the_bounds(small, tmp_path):
    benchmark.main([*small, "--out", str(tmp_path)])
    text = (tmp_path / "benchmark.md").read_text()
    assert "cost of transport 0.200" in text
    assert "0.227 for any that passes" in text
    assert "0.239 for a body" in text
    assert "0.163 m/s for that gait" in text
    assert "| heading control |" in text


def test_docs_get_the_same_page_with_their_own_names(small, tmp_path, monkeypatch):
    monkeypatch.setattr(benchmark_page, "DOCS", tmp_path / "docs")
    assert benchmark.main([*small, "--out", str(tmp_path / "out"), "--write-docs"]) == 0
    text = (tmp_path / "docs" / "learning-benchmark.md").read_text()
    assert "(images/learning-field.png)" in text
    assert (tmp_path / "docs" / "images" / "learning-field.png").exists()


def test_docs_keep_the_tasks_that_are_not_played(small, tmp_path, monkeypatch):
    monkeypatch.setattr(benchmark_page, "DOCS", tmp_path / "docs")
    arguments = [*small, "--out", str(tmp_path / "out"), "--write-docs"]
    assert benchmark.main(arguments) == 0
    page, data = (tmp_path / "docs" / f"learning-benchmark.{suffix}" for suffix in ("md", "json"))
    before = page.read_text(), data.read_text()
    monkeypatch.setattr(tasks, "chosen", lambda names: [FIELD])
    assert benchmark.main(arguments) == 0
    assert (page.read_text(), data.read_text()) == before
    assert benchmark.main([*arguments, "--episodes", "5"]) == 0
    assert list(json.loads(data.read_text())["tasks"]) == ["field"], "scores over other fields do not compare"
    assert "## free" not in page.read_text()


def test_policies_of_every_task_are_compared_over_all_tasks():
    """Fast and always there against slow and there in every other scene; a policy of one task has no row."""
    reached, half = np.ones(4, np.bool_), np.array([True, False] * 2)
    fast, slow = ({"is_success": goal, "speed": np.full(4, v)} for goal, v in ((reached, 0.35), (half, 0.15)))
    found = over_all_tasks.over_all(
        {"a": {"fast": fast, "slow": slow, "other": fast}, "b": {"slow": slow, "fast": fast}}
    )
    assert list(found) == ["fast", "slow"]
    assert (found["fast"].middle.value, found["slow"].middle.value) == pytest.approx((0.35, 0.075))
    assert [found["fast"].profile[speed].value for speed in (0.0, 0.1, 0.2, 0.4)] == [1.0, 1.0, 1.0, 0.0]
    assert [found["slow"].profile[speed].value for speed in (0.0, 0.1, 0.2)] == [0.5, 0.5, 0.0]
    assert found["fast"].beaten is None
    assert found["slow"].beaten == (1.0, 1.0, 1.0)
    assert "| slow | 0.075 " in over_all_tasks.text(found, "profiles.png")


def test_an_episode_has_the_mean_self_contact_force():
    """Two robots whose episodes last two and three steps."""

    class Played:
        def reset(self, seed):
            self.step_number = 0
            return np.zeros((2, 1), np.float32), {}

        def step(self, action):
            self.step_number += 1
            ended = np.array([self.step_number >= 2, self.step_number >= 3])
            infos = {"self_contact_force": np.array([1.0, 2.0]) * self.step_number, "time": np.zeros(2)}
            return np.zeros((2, 1), np.float32), np.zeros(2), ended, np.zeros(2, np.bool_), infos

    episodes, _ = rollout.play(Played(), lambda seen: seen, [0, 1])
    np.testing.assert_allclose(episodes["mean_self_contact_force"], [1.5, 4.0])


def test_the_no_slip_speed_of_the_thesis_gait_is_that_of_the_errata():
    assert reference_limits.no_slip_speed(GaitParameters()) == pytest.approx(0.1633, abs=5e-5)
    assert reference_limits.follow_the_leader_cost(0.2) == pytest.approx(0.239, abs=5e-4)


def test_weaving_is_the_length_of_a_taut_string():
    """Against a string drawn tight numerically between the inflated pegs of a regular course."""
    along, across, radius, half_width = 0.37, 0.17, 0.12, 0.05
    pegs = [(radius, along * k, across * (k % 2)) for k in range(3)]
    rho, x = radius + half_width, np.linspace(0.0, 2 * along, 401)
    low, high = np.full(401, -9.0), np.full(401, 9.0)
    for k, (_, centre, y) in enumerate(pegs):
        near = np.abs(x - centre) < rho
        rise = np.sqrt(rho**2 - (x[near] - centre) ** 2)
        (high if k % 2 else low)[near] = y - rise if k % 2 else y + rise
    string = np.clip(np.zeros(401), low, high)
    string[[0, 200, 400]] = low[0], high[200], low[400]
    for _ in range(20_000):
        string[1:-1] = np.clip(0.5 * (string[:-2] + string[2:]), low[1:-1], high[1:-1])
        string[200] = high[200]
    expected = np.hypot(np.diff(string), np.diff(x)).sum() / (2 * along)
    assert reference_limits.weaving(Scene(obstacles=pegs), half_width) == pytest.approx(expected, rel=1e-3)
    assert 1.1 < reference_limits.weaving() < 1.0 / reference_limits.straightness(GaitParameters())


def test_no_commanded_wave_is_faster_than_the_fastest():
    fastest = reference_limits.no_slip_speed(reference_limits.FASTEST_WAVE)
    for a, omega, beta in itertools.product((15, 30, 65), (80, 200), (-25, -40, -75)):
        assert reference_limits.no_slip_speed(GaitParameters(a * DEGREE, omega * DEGREE, beta * DEGREE)) <= fastest


def test_among_pegs_the_thesis_gait_keeps_below_its_bounds():
    """On the course of Table 7.5, made for it: nearly the speed without slip, and no cost below mu."""
    gait = cached_scores.scripted("thesis gait").make(tasks.load()["course"])
    played = rollout.run_episodes(gait, "SnakeCourse-v1", seeds.selection(2), 1)
    assert (
        0.9 * reference_limits.no_slip_speed(GaitParameters())
        < played["speed"].mean()
        < reference_limits.no_slip_speed(GaitParameters())
    )
    assert played["cost_of_transport"].min() > reference_limits.follow_the_leader_cost(0.2)


def test_paths_may_have_names():
    assert benchmark.named_path("mine=a/b.zip")[0] == "mine"
    assert benchmark.named_path("runs/field/policy.safetensors")[0] == "field"
    assert benchmark.named_path("snake_env/policies/shipped/field-hard.safetensors")[0] == "field-hard"


def test_two_policies_of_one_name_are_refused():
    paths = [benchmark.named_path(f"{folder}/seed-0/policy.safetensors") for folder in ("one", "two")]
    with pytest.raises(ConfigError, match=r"policy = seed-0 \(two.*NAME=PATH"):
        cached_scores.entries(cached_scores.CONFIG, [], paths)
