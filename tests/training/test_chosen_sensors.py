"""What is trained with chosen sensors is loaded and entered with them."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("stable_baselines3")

import numpy as np
import torch

from snake_env import ConfigError, evaluate
from snake_env.evaluation.rollout import make_env
from snake_env.policies import Network, memory
from training import config as configs
from training import runs, train
from training.learners import agent

TOUCH = '{"observation_blocks": ["joint_angle", "heading", "wave", "touch"], "robot_class": "aiko"}'


@pytest.mark.parametrize(
    ("learner", "more"),
    [("sb3", []), ("ppo", ["--policy.memory", "0.5", "--policy.symmetric"])],
)
def test_a_run_with_chosen_blocks_is_entered_with_them(learner, more, tmp_path):
    command = ["--config", "smoke", "--no-bar", "--learner", learner, "--total-steps", "256", "--env", TOUCH]
    assert train.main([*command, *more, "--out", str(tmp_path / "run")]) == 0
    policy = runs.RunFolder(tmp_path / "run").policy
    found = evaluate(policy, "field-hard", track="touch", robot_class="ideal", episodes=1)
    assert found.track == "touch"
    assert evaluate(policy, episodes=1).task.options["robot_class"] == "aiko"
    with pytest.raises(ConfigError, match=r"^observation_blocks = touch: expected blocks of the track proprioception"):
        evaluate(policy, "field-hard", track="proprioception", episodes=1)


BLOCKS = ["joint_angle", "heading", "velocity", "wave", "pegs", "touch"]
SENSES = ["joint_angle", "heading", "wave", "touch"]


def test_an_actor_that_senses_less_than_its_critic_is_entered_with_what_it_senses(tmp_path):
    """The file acts on its own blocks as the actor of the run did on those of the critic."""
    command = ["--config", "smoke", "--no-bar", "--learner", "ppo", "--total-steps", "256"]
    command += ["--env", json.dumps({"observation_blocks": BLOCKS}), "--policy.senses", *SENSES]
    command += ["--policy.memory", "0.5", "--policy.symmetric", "--out", str(tmp_path / "run")]
    assert train.main(command) == 0
    run = runs.RunFolder(tmp_path / "run")
    policy = Network(run.policy)
    assert evaluate(policy, "field-hard", track="touch", episodes=1).track == "touch"

    config = run.config()
    of_run = make_env(config.env_id, 4, 1, **config.env)
    seen, layout = of_run.reset(seed=[0, 1, 2, 3])[0], of_run.unwrapped.layout
    own = make_env(config.env_id, 4, 1, **config.acting_env)
    sensed = own.reset(seed=[0, 1, 2, 3])[0]
    policy.begin(own.unwrapped.layout, 4)
    actor = agent.make_agent(config, len(memory.network_inputs(layout, (0.5,))), len(layout["action"]))
    actor.load_state_dict(torch.load(run.latest(), weights_only=True)["agent"])
    traced = memory.MemoryTraces(layout, (0.5,), 4)(seen)
    with torch.no_grad():
        acted = actor.actor(torch.from_numpy(traced)).numpy()
    np.testing.assert_allclose(policy(sensed), acted, atol=1e-5)
    names = memory.network_inputs(layout, (0.5,))
    moved = np.array([name.partition(":")[0] in ("velocity", "pegs") for name in names], np.float32)
    with torch.no_grad():
        same = actor.actor(torch.from_numpy(traced + moved)).numpy()
        value, other = (actor.value(torch.from_numpy(one)) for one in (traced, traced + moved))
    assert moved.any()
    assert np.array_equal(same, acted)
    assert not torch.equal(value, other)


def test_an_actor_senses_what_the_observation_has():
    config = configs.PpoConfig(env={"observation_blocks": BLOCKS}, policy={"senses": ("joint_angle", "gyro")})
    with pytest.raises(ConfigError, match=r"^policy\.senses = gyro: expected a block that env\.observation_blocks has"):
        agent.sensed(config)
