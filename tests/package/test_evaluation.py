"""Policies of the user's own, played by the protocol of the benchmark."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("scipy")

import snake_env
from snake_env import ConfigError, SnakeVectorEnv
from snake_env.evaluation import BenchmarkTask, evaluate, seeds

OPEN = BenchmarkTask("open", "SnakeFree-v1", {"goal": 1.0, "max_episode_steps": 300})


def wave(frequency):
    def act(observation):
        return np.tile(np.float32([0.0, frequency, 0.0, 0.0]), (len(observation), 1))

    return act


def test_scores_are_those_of_the_test_scenes():
    found = evaluate(wave(1.0), OPEN, scenes=3, name="wave")
    env = SnakeVectorEnv(3, task="free", goal=1.0, max_episode_steps=300, autoreset_mode="Disabled")
    env.reset(seed=seeds.held_out(3))
    time = np.zeros(3)
    while not time.all():
        running = time == 0.0
        if not running.all():
            env.reset(options={"reset_mask": ~running})
        _, _, terminated, _, infos = env.step(np.tile(np.float32([0.0, 1.0, 0.0, 0.0]), (3, 1)))
        time = np.where(running & terminated, infos["time"], time)
    np.testing.assert_allclose(found.episodes["time"], time)
    assert found.scores["time_to_goal"].value == pytest.approx(time.mean())
    assert found.scores["success"] == (1.0, 1.0, 1.0)
    assert str(found).splitlines()[1].startswith("wave")


def test_a_policy_is_compared_scene_by_scene():
    fast, slow = (evaluate(wave(frequency), OPEN, scenes=4) for frequency in (1.0, -0.5))
    assert fast.against(slow)["success"] == (1.0, 1.0, 1.0)
    assert fast.against(slow)["speed"].low > 0.0
    with pytest.raises(ConfigError, match=r"^other = open on 3 scenes: expected an evaluation of open on 4 scenes"):
        fast.against(evaluate(wave(1.0), OPEN, scenes=3))


def test_a_longer_control_period_brings_no_more_time():
    task = BenchmarkTask("short", "SnakeField-v1", {"max_episode_steps": 4})
    for period, steps in ((0.1, 2), (0.05, 4), (0.02, 10)):
        found = evaluate(wave(-1.0), task, episodes=1, env_options={"control_period": period})
        np.testing.assert_allclose(found.episodes["time"], steps * period)


def test_a_shipped_policy_brings_its_own_options():
    task = BenchmarkTask("short", "SnakeField-v1", {"max_episode_steps": 3})
    assert evaluate(snake_env.load_policy("field-hard"), task, scenes=2).name == "field-hard"
    with pytest.raises(ConfigError, match=r"^env_options = "):
        evaluate(snake_env.load_policy("field-hard"), task, scenes=2, env_options={"action_mode": "gait"})


class Unfinished(snake_env.policies.Policy):
    """Has the methods that it inherits, but neither name nor env_options."""

    def __call__(self, observation):
        return np.zeros((len(observation), 4), np.float32)


@pytest.mark.parametrize(
    ("policy", "options", "field"),
    [
        (3, {}, "policy"),
        (Unfinished(), {}, "policy"),
        (wave(0.0), {"task": "moon"}, "task"),
        (wave(0.0), {"scenes": 0}, "scenes"),
        (wave(0.0), {"scenes": 2.5}, "scenes"),
        (wave(0.0), {"env_options": {"difficulty": 0.0}}, r"env_options\['difficulty'\]"),
    ],
)
def test_what_does_not_fit_is_named(policy, options, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        evaluate(policy, **({"scenes": 1} | options))
