"""Cached episodes belong to what was played, and nothing beats what cannot be beaten."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from snake_env import Scene, load_policy
from snake_env.evaluation import rollout, seeds, tasks
from snake_env.policies import interface
from snake_env.policies.gaits import DEGREE, GaitParameters
from training.evaluation import cached_scores, reference_limits

FIELD = tasks.BenchmarkTask("field", "SnakeField-v1", {"max_episode_steps": 40}, "short fields, for tests")


def test_cached_episodes_belong_to_task_fields_and_code(tmp_path, monkeypatch):
    played = []
    play = rollout.run_episodes
    monkeypatch.setattr(rollout, "run_episodes", lambda *given, **options: played.append(1) or play(*given, **options))
    entry = cached_scores.Entry("gait", lambda task: load_policy("gait"), lambda task: b"gait")
    fields = seeds.held_out(2)
    harder = tasks.BenchmarkTask("field", "SnakeField-v1", {"difficulty": 1.0, "max_episode_steps": 40}, "")
    for task, some in ((FIELD, fields), (FIELD, fields), (harder, fields), (FIELD, fields[:1])):
        cached_scores.Bench(tmp_path, some, 1).episodes(task, entry)
    assert len(played) == 3
    code = cached_scores.sources()
    played_by = ("snake_env/vector_env.py", "snake_env/registration.py", "snake_env/config/robot.py")
    assert {cached_scores.ROOT / one for one in (*played_by, "snake_env/policies/network.py")} <= set(code)
    changed = tmp_path / "vector_env.py"
    changed.write_text("another")
    monkeypatch.setattr(cached_scores, "sources", lambda: [changed, *code])
    cached_scores.Bench(tmp_path, fields, 1).episodes(FIELD, entry)
    assert len(played) == 4


def test_fields_are_held_out():
    assert seeds.require_held_out(seeds.held_out(500)) is None
    for other in (seeds.TRAINING.start, seeds.SELECTION.start, seeds.TRAINING.stop):
        with pytest.raises(ValueError, match=f"seed = {other}: expected a held-out one"):
            cached_scores.Bench(None, [*seeds.held_out(2), other])


def test_a_policy_chooses_its_interface_and_not_the_task():
    """A policy trained on easy fields is judged on the task's."""
    trained_with = {"difficulty": 0.0, "perception": "blind", "start_jitter": 0.0}
    assert interface(trained_with) == {"perception": "blind"}


def test_an_episode_has_the_mean_self_contact_force():
    """Two robots whose episodes last two and three steps."""

    class Played:
        unwrapped = SimpleNamespace(layout={"control_period": 0.05})

        def reset(self, seed):
            self.step_number = 0
            return np.zeros((2, 1), np.float32), {}

        def step(self, action):
            self.step_number += 1
            ended = np.array([self.step_number >= 2, self.step_number >= 3])
            infos = {"self_contact_force": np.array([1.0, 2.0]) * self.step_number}
            infos |= {name: np.zeros(2) for name in ("time", "contacts", "progress")}
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
    gait = load_policy("gait")
    played = rollout.run_episodes(gait, "SnakeCourse-v1", seeds.selection(2), 1)
    assert (
        0.9 * reference_limits.no_slip_speed(GaitParameters())
        < played["speed"].mean()
        < reference_limits.no_slip_speed(GaitParameters())
    )
    assert played["cost_of_transport"].min() > reference_limits.follow_the_leader_cost(0.2)
