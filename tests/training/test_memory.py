"""Traces are running means of what was felt; learner, files and clones agree on them."""

import math

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from snake_env import ConfigError
from snake_env.evaluation import rollout
from snake_env.policies import Network, files
from snake_env.policies.memory import MemoryTraces, network_inputs, remembered, time_constants
from training import config
from training.learners import agent, behaviour_cloning, ppo

TIMES = (0.5, 3.0)
LAYOUT = {
    "control_period": 0.05,
    "observation": [
        {"name": "velocity", "start": 0, "size": 2, "elements": ["x", "y"], "memory": True},
        {"name": "pegs", "start": 2, "size": 1, "elements": ["peg_1_left"], "memory": False},
        {"name": "yaw_rate", "start": 3, "size": 1, "elements": ["yaw_rate"], "memory": True},
    ],
}


def settings(**policy):
    return config.PpoConfig(
        num_envs=16,
        num_threads=1,
        env={"max_episode_steps": 10, "perception": "body"},
        policy=config.PpoNetworks(hidden=(16, 16), memory=TIMES, **policy),
        ppo=config.Ppo(n_steps=16, batch_size=128, n_epochs=2),
    )


def test_a_trace_follows_a_step_like_a_first_order_lag():
    memory = MemoryTraces(LAYOUT, TIMES, 1)
    memory(np.zeros((1, 4), np.float32))
    for _ in range(40):
        seen = memory(np.array([[1.0, -2.0, 5.0, 4.0]], np.float32))
    lag = [1.0 - math.exp(-40 * 0.05 / time) for time in TIMES]
    expected = [share * felt for share in lag for felt in (1.0, -2.0, 4.0)]
    np.testing.assert_allclose(seen[0], [1.0, -2.0, 5.0, 4.0, *expected], rtol=1e-5)
    assert network_inputs(LAYOUT, TIMES)[4:6] == ["velocity: x, over 0.5 s", "velocity: y, over 0.5 s"]


def test_an_episode_begins_without_a_past():
    memory = MemoryTraces(LAYOUT, TIMES, 2)
    memory(np.ones((2, 4), np.float32))
    memory.reset(np.array([True, False]))
    seen = memory(np.zeros((2, 4), np.float32))
    assert not seen[0].any()
    assert seen[1].any()


def test_foreseeing_is_what_moving_on_gives_and_does_not_move_on():
    memory = MemoryTraces(LAYOUT, TIMES, 3)
    rng = np.random.default_rng(0)
    first, second = rng.standard_normal((2, 3, 4)).astype(np.float32)
    memory(first)
    foreseen = memory.peek(second[1:], np.array([1, 2]))
    assert np.array_equal(foreseen, memory(second)[1:])


def test_the_collector_hands_on_traces_that_follow_from_its_observations():
    """Recomputed from the plain observations of a rollout with ends in it."""
    learner = ppo.Learner(settings(), 0, lambda *episode: None)
    learner.collect()
    layout = rollout.layout_of("SnakeField-v1", learner.config.env)
    played = learner.rollout
    plain = sum(block["size"] for block in layout["observation"])
    memory = MemoryTraces(layout, TIMES, 16)
    assert played.done.any()
    for seen, done in zip(played.observation.numpy(), played.done, strict=True):
        assert np.array_equal(memory(seen[:, :plain]), seen)
        memory.reset(done)


def test_numpy_plays_the_memory_that_torch_has_learnt(tmp_path):
    learner = ppo.Learner(settings(symmetric=True), 0, lambda *episode: None)
    learner.collect()
    learner.learn(0.0)
    files.write(tmp_path / "policy.safetensors", learner.agent.arrays(), learner.config.model_dump(mode="json"))
    policy = Network(tmp_path / "policy.safetensors")
    layout = rollout.layout_of("SnakeField-v1", learner.config.env)
    plain = sum(block["size"] for block in layout["observation"])
    policy.begin(layout, 16)
    for t in range(16):
        seen = learner.rollout.observation[t]
        with torch.no_grad():
            expected = learner.agent.actor(seen).numpy()
        np.testing.assert_allclose(policy(seen.numpy()[:, :plain]), expected, rtol=1e-5, atol=1e-6)
        policy.reset(learner.rollout.done[t])


def test_a_policy_with_memory_names_observations_of_another_size(tmp_path):
    learner = ppo.Learner(settings(), 0, lambda *episode: None)
    files.write(tmp_path / "policy.safetensors", learner.agent.arrays(), learner.config.model_dump(mode="json"))
    with pytest.raises(ConfigError, match="observation = shape"):
        Network(tmp_path / "policy.safetensors")(np.zeros((1, 3), np.float32))


def test_a_policy_with_other_observations_is_named(tmp_path):
    learner = ppo.Learner(settings(), 0, lambda *episode: None)
    files.write(tmp_path / "policy.safetensors", learner.agent.arrays(), learner.config.model_dump(mode="json"))
    policy = Network(tmp_path / "policy.safetensors")
    with pytest.raises(ValueError, match=r"expected a policy with 71 inputs, as .*; this one has 152"):
        policy.begin(rollout.layout_of("SnakeFree-v1", {}), 1)


def test_the_mirror_turns_traces_like_what_they_are_traces_of():
    run = settings(symmetric=True)
    layout = rollout.layout_of(run.env_id, run.env)
    signs = agent.reflection_of(run).observation
    plain = sum(block["size"] for block in layout["observation"])
    felt = len(remembered(layout))
    assert len(signs) == plain + 2 * felt
    assert np.array_equal(signs[plain:], np.tile(signs[remembered(layout)], 2))


def test_a_policy_without_a_memory_can_be_taken_over_by_one_with(tmp_path):
    """It acts as before, whatever it remembers, until it learns to use it."""
    before = settings().with_changes(policy=config.PpoNetworks(hidden=(16, 16)), env={})
    giver = ppo.Learner(before, 0, lambda *episode: None).agent
    files.write(tmp_path / "policy.safetensors", giver.arrays(), before.model_dump(mode="json"))
    learner = ppo.Learner(settings(), 0, lambda *episode: None)
    layout = rollout.layout_of(before.env_id, learner.config.env)
    behaviour_cloning.take_over(learner.agent, layout, TIMES, tmp_path / "policy.safetensors")
    plain = len(network_inputs(rollout.layout_of(before.env_id, before.env), ()))
    seen = torch.rand(5, learner.collector.observations)
    torch.testing.assert_close(learner.agent.actor(seen), giver.actor(seen[:, :plain]))


def test_half_precision_is_that_of_the_hidden_layers_alone():
    whole, half = (agent.make_agent(settings(bfloat16=half), 40, 4) for half in (False, True))
    half.load_state_dict(whole.state_dict())
    seen = torch.rand(64, 40)
    with torch.no_grad():
        expected, found = whole.value(seen), half.value(seen)
    assert found.dtype == torch.float32
    assert 0.0 < (found - expected).abs().max() < 0.02


def test_half_precision_is_the_same_without_instructions_for_it(monkeypatch):
    """Outputs within two spacings of bfloat16 numbers below one, gradients within two in a hundred."""
    torch.manual_seed(0)
    actor_critic = agent.make_agent(settings(bfloat16=True), 40, 4)
    seen, outputs, gradients = torch.rand(256, 40), [], []
    for native in (True, False):
        monkeypatch.setattr(agent, "MULTIPLIES_BFLOAT16", native)
        actor_critic.zero_grad()
        outputs.append(actor_critic.actor[0](seen))
        outputs[-1].square().mean().backward()
        gradients.append([weights.grad for weights in actor_critic.actor[0].parameters()])
    difference = (outputs[0] - outputs[1]).detach().abs()
    assert outputs[1].dtype == torch.float32
    assert difference.max() <= 2.0**-7
    assert difference.mean() < 1e-4
    for native, rounded in zip(*gradients, strict=True):
        assert (native - rounded).norm() < 0.02 * native.norm()


def test_networks_without_hidden_layers_are_linear():
    actor_critic = agent.make_agent(config.PpoConfig(policy=config.PpoNetworks(hidden=())), 40, 4)
    seen = torch.rand(2, 40)
    torch.testing.assert_close(
        actor_critic.actor(seen[0] + seen[1]), actor_critic.actor(seen[0]) + actor_critic.actor(seen[1])
    )


def test_times_are_positive():
    with pytest.raises(ValueError, match="greater than 0"):
        config.PpoNetworks(memory=(0.0,))


@pytest.mark.parametrize("name", ["memory", "traces"])
def test_a_file_of_either_name_has_its_memory(name):
    assert time_constants({"policy": {name: TIMES}}) == TIMES
