"""Scripted controllers do what their sources say, sense no more than a learned policy, and are tuned fairly."""

import json
from typing import ClassVar

import numpy as np
import pytest

from snake_env.evaluation import rollout, seeds, tasks
from snake_env.policies.gaits import DEGREE
from snake_env.policies.scripted import catalogue
from snake_env.policies.scripted.controller import Controller
from snake_env.policies.scripted.gaits import HeadingGait
from snake_env.policies.scripted.reflex import ContactReflex
from snake_env.policies.scripted.sensors import Sensors
from training import cli
from training.search import tune
from training.search.optimise import Plan, maximise

FIELD = tasks.BenchmarkTask("field", "SnakeField-v1", {"difficulty": 0.5, "max_episode_steps": 60}, "short")

ANY = {
    title: {name: float(np.median(kind.ranges[name])) for name in kind.ranges}
    for title, kind in catalogue.CONTROLLERS.items()
}


def begun(title, env_id="SnakeField-v1", num_envs=3, **changes):
    """A controller with middling parameters on a fresh batch: controller, environment, first observation."""
    policy = catalogue.CONTROLLERS[title](ANY[title] | changes)
    env = rollout.make_env(env_id, num_envs, 1, **policy.env_options)
    observation, _ = env.reset(seed=seeds.selection(num_envs))
    policy.begin(env.unwrapped.layout, num_envs)
    return policy, env, observation


def facing(policy, heading, lateral=0.0):
    """An observation (1, o) of nothing but a heading [rad] and a lateral offset [m]."""
    blocks = policy.sensors._blocks
    observation = np.zeros((1, sum(block["size"] for block in blocks.values())), np.float32)
    start = blocks["heading"]["start"]
    observation[0, start : start + 2] = np.sin(heading), np.cos(heading)
    observation[0, blocks["lateral_offset"]["start"]] = lateral / blocks["lateral_offset"]["scale"]
    return observation


@pytest.mark.parametrize("title", catalogue.CONTROLLERS)
def test_actions_stay_in_range_and_repeat_themselves(title):
    def played():
        policy, env, observation = begun(title)
        actions = []
        for _ in range(30):
            actions.append(policy(observation))
            observation = env.step(actions[-1])[0]
        return np.array(actions)

    first = played()
    assert first.dtype == np.float32
    assert np.abs(first).max() <= 1.0
    assert np.array_equal(first, played())


@pytest.mark.parametrize("title", catalogue.CONTROLLERS)
def test_robots_do_not_depend_on_their_neighbours(title):
    """One robot alone does what it does in a batch whose other robots have other parameters."""
    values = {
        name: np.array([value, *bounds])
        for (name, value), bounds in zip(ANY[title].items(), catalogue.CONTROLLERS[title].ranges.values(), strict=True)
    }
    together = rollout.run_episodes(
        catalogue.CONTROLLERS[title](values), "SnakeField-v1", [7, 8, 9], 1, max_episode_steps=40
    )
    alone = rollout.run_episodes(
        catalogue.CONTROLLERS[title](ANY[title]), "SnakeField-v1", [7], 1, max_episode_steps=40
    )
    assert together["distance"][0] == alone["distance"][0]


@pytest.mark.parametrize("title", catalogue.CONTROLLERS)
def test_reset_clears_the_last_episode(title):
    policy, env, observation = begun(title)
    fresh = policy(observation)
    later = observation
    for _ in range(20):
        later = env.step(policy(later))[0]
    policy.reset(np.array([True, False, True]))
    again = policy(observation)
    assert np.array_equal(again[[0, 2]], fresh[[0, 2]])


def test_unknown_parameters_and_controllers_are_named():
    with pytest.raises(ValueError, match="expected values for"):
        HeadingGait({"amplitude": 1.0})
    with pytest.raises(ValueError, match="policy = none: expected one of best-gait"):
        catalogue.tuned("none", "field")
    with pytest.raises(ValueError, match="expected one tuned for nowhere"):
        catalogue.tuned("best gait", "nowhere")


def test_link_directions_are_those_of_the_links():
    """Against the poses of the simulation, which no policy sees."""
    policy, env, observation = begun("best gait", num_envs=1)
    for _ in range(25):
        observation = env.step(policy(observation))[0]
    sensors = Sensors(env.unwrapped.layout)
    sensors.read(observation)
    angles = env.unwrapped.state().link_angle[0] + np.pi
    wrapped = (sensors.link_directions[0] - angles + np.pi) % (2 * np.pi) - np.pi
    # Single precision of the observation.
    np.testing.assert_allclose(wrapped, 0.0, atol=1e-5)


def test_heading_control_turns_the_head_towards_the_way_back():
    policy, _, _ = begun("heading control", num_envs=1)
    offset = 3
    ahead, left, off = (policy(facing(policy, *pose))[0, offset] for pose in ((0.0,), (0.4,), (0.0, 0.5)))
    assert ahead == pytest.approx(0.0, abs=1e-6)
    assert left > 0.05, "heading to the left: the head turns right"
    assert off > 0.05, "left of the centre line: the head turns right"


def test_heading_control_keeps_a_line_that_the_plain_wave_leaves():
    """Orthotropic ground, 20 s, start poses at random: the wave without feedback turns away."""
    values = {"amplitude": 40 * DEGREE, "omega": 140 * DEGREE, "beta": -50 * DEGREE, "look_ahead": 1.0}
    options = {"goal_distance": 20.0, "corridor_half_width": 5.0, "max_episode_steps": 400}

    def errors(steering):
        policy = HeadingGait(values | {"steering": steering})
        return np.abs(rollout.run_episodes(policy, "SnakeFree-v1", seeds.selection(6), 1, **options)["lateral_offset"])

    assert errors(0.3).mean() < 0.5 * errors(0.0).mean()


def test_the_taper_lowers_the_head_and_leaves_the_tail():
    policy, _, observation = begun("best gait", num_envs=1, taper=0.3)
    residual = policy(observation)[0, 4:]
    assert residual[-1] == 0.0
    assert np.abs(residual).max() > 0.05


def test_jam_resolving_turns_links_so_that_pegs_push_ahead():
    """The propulsive part -f sin(psi - psi_d) of the contact forces grows along the rotation, to first order."""
    policy, env, observation = begun("jam resolving", num_envs=4)
    force = env.unwrapped.layout["observation"]
    start = next(block["start"] for block in force if block["name"] == "contact_force")
    observation = observation.copy()
    observation[:, start : start + 11] = np.random.default_rng(3).uniform(-1, 1, (4, 11))
    policy.sensors.read(observation)
    turned = policy._rotations()
    links = np.concatenate([np.zeros((4, 1)), np.cumsum(turned, axis=1)], axis=1)
    tilt = policy.sensors.link_directions - policy.wanted_heading()[:, None]
    gain = (-policy.sensors["contact_force"] * np.cos(tilt) * links).sum(axis=1)
    first = -policy["rotation"] * np.cos(tilt[:, 0])  # link 1 stays where the sum begins
    share = policy.sensors["contact_force"] / np.abs(policy.sensors["contact_force"]).max(axis=1, keepdims=True)
    gain += (-policy.sensors["contact_force"] * np.cos(tilt)).sum(axis=1) * first * share[:, 0]
    assert np.all(gain > 0.0)


def test_jam_resolving_acts_on_jams_alone():
    policy, _, _ = begun("jam resolving", num_envs=1)
    still = facing(policy, 0.0)
    moving = still.copy()
    moving[0, policy.sensors._blocks["velocity"]["start"]] = 0.5
    assert np.all(policy(moving)[0, 4:] == 0.0)
    still[0, policy.sensors._blocks["contact_force"]["start"] + 4] = 0.5
    before = [np.abs(policy(still)[0, 4:]).max() for _ in range(10)]
    after = [np.abs(policy(still)[0, 4:]).max() for _ in range(5)]
    assert max(before) == 0.0
    assert min(after) > 0.1


def test_without_contact_the_reflex_controller_is_a_travelling_wave():
    """Commanded angles of a rigid follower: each joint repeats the one ahead of it a delay later."""
    policy, _, observation = begun("contact reflex", num_envs=1, compliance=0.0, steering=0.15)
    observation = np.repeat(facing(policy, 0.0), 1, axis=0)
    commanded = np.array([policy(observation)[0] for _ in range(200)])
    delay = int(policy._delay[0])
    np.testing.assert_allclose(commanded[delay:, 1:], commanded[:-delay, :-1], atol=1e-6)


def test_a_reflex_bends_the_joints_beside_the_force():
    policy, _, _ = begun("contact reflex", num_envs=1, compliance=0.0, reflex_ahead=0.01, reflex_behind=-0.01)
    calm = facing(policy, 0.0)
    pushed = calm.copy()
    pushed[0, policy.sensors._blocks["contact_force"]["start"] + 5] = 0.5
    other = ContactReflex(ANY["contact reflex"] | {"compliance": 0.0, "reflex_ahead": 0.01, "reflex_behind": -0.01})
    other.begin(
        {
            "observation": list(policy.sensors._blocks.values()),
            "control_period": 0.05,
            "action": [{"low": -1.0, "high": 1.0}] * 10,
        },
        1,
    )
    policy._low, policy._high = other._low, other._high
    change = (policy(pushed) - other(calm))[0]
    # 10 N times 0.01 rad/N: joint 5 (index 4) lies ahead of link 6, joint 6 behind it.
    np.testing.assert_allclose(change, np.r_[np.zeros(4), -0.1, 0.1, np.zeros(4)], atol=1e-6)


class Limp(Controller):
    """For the tuning: only an amplitude."""

    title = "limp"
    mode = "gait"
    ranges: ClassVar = {"amplitude": (20 * DEGREE, 40 * DEGREE), "omega": (0.0, 150 * DEGREE)}

    def command(self):
        still = np.zeros(self.num_envs)
        return np.stack([self["amplitude"], self["omega"], still - 50 * DEGREE, still], axis=1)


def test_tuning_finds_what_moves():
    task = tasks.BenchmarkTask("free", "SnakeFree-v1", {"max_episode_steps": 60}, "open ground")
    found = tune.tune(Limp, task, Plan(4, 8, 2, 2, 2), 1)
    assert found["values"]["omega"] == pytest.approx(150 * DEGREE, rel=0.2)


def test_tuning_uses_seeds_for_choosing_alone(monkeypatch):
    used = []
    played = rollout.run_episodes

    def spy(policy, env_id, fields, *rest, **options):
        used.extend(fields)
        return played(policy, env_id, fields, *rest, **options)

    monkeypatch.setattr(rollout, "run_episodes", spy)
    tune.tune(Limp, FIELD, Plan(1, 2, 2, 2, 3), 1)
    assert used
    assert all(seed in seeds.SELECTION for seed in used)


def test_a_search_finds_the_maximum_and_repeats_itself():
    """Of a paraboloid; the fixed number stays where it is."""
    ranges = {"x": (-1.0, 1.0), "y": (0.0, 4.0), "fixed": (3.0, 3.0)}

    def score(tried, fields):
        return np.array([-((one["x"] - 0.5) ** 2) - (one["y"] - 3.0) ** 2 for one in tried])

    found = maximise(ranges, score, Plan(8, 16, 1, 4, 1))
    assert found.best == maximise(ranges, score, Plan(8, 16, 1, 4, 1)).best
    assert found.best["x"] == pytest.approx(0.5, abs=0.15)
    assert found.best["y"] == pytest.approx(3.0, abs=0.3)
    assert found.best["fixed"] == 3.0
    assert len(found.tried) == 8 * 16


def test_finalists_play_on_other_fields():
    """A candidate that was lucky on the fields of the search does not win."""

    def score(tried, fields):
        lucky = fields[0] == seeds.SELECTION.start
        return np.array([one["x"] if lucky else -one["x"] for one in tried])

    found = maximise({"x": (0.0, 1.0)}, score, Plan(1, 8, 2, 8, 2))
    assert found.best["x"] == min(one["x"] for one in found.tried)


def test_a_known_candidate_is_in_the_final():
    """Even if it did badly in the search, so that a search never ends below it."""

    def score(tried, fields):
        lucky = fields[0] == seeds.SELECTION.start
        return np.array([one["x"] if lucky else -one["x"] for one in tried])

    found = maximise({"x": (0.0, 1.0)}, score, Plan(2, 8, 2, 1, 2), [{"x": 0.0}])
    assert found.best == {"x": 0.0}
    assert maximise({"x": (0.0, 1.0)}, score, Plan(2, 8, 2, 1, 2)).best["x"] > 0.5


def test_what_stands_gives_way_to_better_values_only(tmp_path, monkeypatch):
    """It takes part, clipped to the ranges; another search with nothing better keeps it."""
    out = tmp_path / "tuned.json"
    values = {name: span[1] + 1.0 for name, span in catalogue.kind("best gait").ranges.items()}
    out.write_text(json.dumps({"field": {"best gait": {"values": values}}}))
    first = tune.standing(out, catalogue.kind("best gait"), FIELD)
    assert first == [{name: span[1] for name, span in catalogue.kind("best gait").ranges.items()}]
    monkeypatch.setattr(tune, "play", lambda kind, tried, *_: scored([one in first for one in tried]))
    found = tune.tune(catalogue.kind("best gait"), FIELD, Plan(1, 4, 1, 1, 1), 1, first)
    assert found["values"] == pytest.approx(first[0], abs=1e-6)
    assert tune.standing(out, catalogue.kind("heading control"), FIELD) == []


def scored(best):
    """Means of candidates, of which some are the best."""
    values = np.array(best, float)
    return {"success": values, "way": values, "speed": values}


def test_the_command_keeps_what_was_tuned_before(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(tune, "PLAN", Plan(1, 2, 1, 1, 1))
    monkeypatch.setattr(tasks, "chosen", lambda names: [FIELD])
    out = tmp_path / "tuned.json"
    for title in ("best gait", "heading control"):
        assert cli.main(["tune", "--controllers", title, "--out", str(out), "--num-threads", "1"]) == 0
    assert set(json.loads(out.read_text())["field"]) == {"best gait", "heading control"}
    assert catalogue.tuned("best gait", "field", out).name == "best gait"


def test_a_task_may_have_the_numbers_of_another_one(tmp_path):
    path, title = tmp_path / "tuned.json", "heading control"
    path.write_text(json.dumps({"plane": {title: {"values": ANY[title]}}, "space": {title: {"tuned_for": "plane"}}}))
    assert catalogue.chosen(title, "space", path) == {"values": ANY[title]}
    assert catalogue.tuned(title, "space", path).title == title
    assert catalogue.chosen("best gait", "space", path) is None


@pytest.mark.parametrize("task", tasks.load())
def test_every_shipped_number_is_within_its_range(task):
    for title in catalogue.read().get(task, {}):
        found = catalogue.chosen(title, task)
        ranges = catalogue.CONTROLLERS[title].ranges
        assert set(found["values"]) == set(ranges)
        for name, value in found["values"].items():
            low, high = ranges[name]
            assert low - 1e-6 <= value <= high + 1e-6, name


def test_unknown_tasks_are_named():
    with pytest.raises(ValueError, match="task = nowhere: expected one of course"):
        tasks.chosen(["nowhere"])
