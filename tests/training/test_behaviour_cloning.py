"""A run that begins as a clone acts like its controller, with a critic that knows what that is worth."""

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from snake_env import ConfigError
from snake_env.evaluation import rollout, seeds
from snake_env.policies import Network, files, memory
from snake_env.policies.loading import load_policy
from snake_env.policies.scripted import catalogue
from snake_env.policies.shipped import policy_path
from training import config, runs
from training.config import BehaviourCloning
from training.learners import agent, behaviour_cloning, ppo

HEADING = BehaviourCloning(controller="heading control", task="field-hard", rounds=6, critic_rounds=2)


def settings(mode="residual", start=HEADING):
    return config.PpoConfig(
        env={"action_mode": mode, "difficulty": 1.0},
        num_envs=32,
        num_threads=1,
        behaviour_cloning=start,
        ppo=config.Ppo(n_steps=32),
        policy=config.PpoNetworks(hidden=(32, 32), log_std=-1.5),
    )


def begun(run):
    learner = ppo.Learner(run, 0, lambda *episode: None)
    behaviour_cloning.begin(learner, run.behaviour_cloning)
    return learner


def observations(mode):
    """What robots that move at random see on a few fields (n, o), and the layout."""
    env = rollout.make_env("SnakeField-v1", 16, 1, action_mode=mode, difficulty=1.0)
    seen, _ = env.reset(seed=seeds.selection(16))
    rng = np.random.default_rng(0)
    for _ in range(30):
        seen = env.step(rng.uniform(-0.3, 0.3, (16, env.single_action_space.shape[0])).astype(np.float32))[0]
    return seen, env.unwrapped.layout


@pytest.mark.parametrize("mode", ["gait", "residual"])
def test_a_clone_acts_like_its_controller(mode):
    learner = begun(settings(mode))
    seen, layout = observations(mode)
    told = behaviour_cloning.Expert(HEADING, layout, len(seen))(seen)
    with torch.no_grad():
        acted = learner.agent.actor(torch.from_numpy(seen)).numpy()
    assert np.square(told).mean() > 0.1
    assert np.square(acted - told).mean() < 0.02


def test_an_expert_says_what_the_controller_does_in_its_own_mode():
    seen, layout = observations("residual")
    controller = catalogue.tuned("heading control", "field-hard")
    own = observations("gait")[1]
    controller.begin(own, len(seen))
    alone = seen[:, : sum(block["size"] for block in own["observation"])]  # what it reads stands in the same places
    told = behaviour_cloning.Expert(HEADING, layout, len(seen))(seen)
    np.testing.assert_array_equal(told[:, :4], controller(alone))
    assert not told[:, 4:].any()


def test_the_critic_learns_while_the_actor_rests():
    with_critic, without = (begun(settings(start=HEADING.with_changes(critic_rounds=k))).agent for k in (3, 0))
    assert torch.equal(with_critic.actor[-1].weight, without.actor[-1].weight)
    assert not torch.equal(with_critic.critic[-1].weight, without.critic[-1].weight)


def test_controllers_of_other_modes_are_named():
    _, layout = observations("gait")
    with pytest.raises(ValueError, match="controller = contact reflex: expected one that acts by gait"):
        behaviour_cloning.Expert(BehaviourCloning(controller="contact reflex", task="field-hard"), layout, 1)


def test_controllers_with_a_memory_forget_when_episodes_end():
    """Labels along a rollout are those of fresh controllers after each end."""
    seen, layout = observations("residual")
    jammed = BehaviourCloning(controller="jam resolving", task="field-hard")
    stay = torch.from_numpy(np.repeat(seen[None, :1] * 0.0, 24, axis=0))
    never, once = np.zeros((24, 1), np.bool_), np.zeros((24, 1), np.bool_)
    once[11] = True
    kept, forgot = (
        behaviour_cloning.labels(behaviour_cloning.Expert(jammed, layout, 1), stay, done).numpy()
        for done in (never, once)
    )
    assert np.array_equal(kept[:12], forgot[:12])
    assert np.array_equal(forgot[12:], forgot[:12])
    assert not np.array_equal(kept, forgot)


def test_a_run_that_begins_as_a_clone_leaves_a_policy_that_moves(tmp_path):
    run = runs.RunFolder(tmp_path)
    made = settings().with_changes(total_steps=1)
    run.create(made)
    assert run.config() == made
    assert ppo.train(run, made, False) == 0
    policy = Network(run.policy)
    cloned = rollout.run_episodes(policy, "SnakeField-v1", seeds.selection(12), 1, difficulty=1.0, max_episode_steps=60)
    expert = catalogue.tuned("heading control", "field-hard")
    told = rollout.run_episodes(expert, "SnakeField-v1", seeds.selection(12), 1, difficulty=1.0, max_episode_steps=60)
    assert cloned["distance"].mean() > 0.7 * told["distance"].mean() > 0.2


def donor(path, mode, observations, actions, hidden=(8, 8)):
    """A policy with random weights and biases, and its file."""
    actor_critic = agent.Agent(observations, actions, config.PpoNetworks(hidden=hidden), None)
    torch.nn.init.normal_(actor_critic.actor[-1].bias)
    env = {"action_mode": mode}
    files.write(path, actor_critic.arrays(), {"env_id": "SnakeField-v1", "env": env})
    return actor_critic


def test_a_policy_trained_before_is_taken_over(tmp_path):
    giver = donor(tmp_path / "giver.safetensors", "gait", 63, 4)
    heir = agent.Agent(63, 4, config.PpoNetworks(hidden=(8, 8)), None)
    behaviour_cloning.take_over(heir, observations("gait")[1], (), tmp_path / "giver.safetensors")
    seen = torch.rand(5, 63)
    assert torch.equal(heir.actor(seen), giver.actor(seen))
    wider = agent.Agent(63, 4, config.PpoNetworks(hidden=(9, 8)), None)
    with pytest.raises(ValueError, match=r"policy = .*giver\.safetensors: expected hidden layers \[9, 8\]"):
        behaviour_cloning.take_over(wider, observations("gait")[1], (), tmp_path / "giver.safetensors")
    with pytest.raises(ConfigError, match=r"policy = .*nobody\.safetensors: expected the policy\.safetensors"):
        behaviour_cloning.take_over(wider, observations("gait")[1], (), tmp_path / "nobody.safetensors")


def test_a_policy_of_another_interface_is_taken_over_by_name(tmp_path):
    """From the wave alone to the wave with offsets: the wave is steered as before, offsets are zero."""
    giver = donor(tmp_path / "giver.safetensors", "gait", 63, 4)
    seen, layout = observations("residual")
    heir = agent.Agent(seen.shape[1], 14, config.PpoNetworks(hidden=(8, 8)), None)
    behaviour_cloning.take_over(heir, layout, (), tmp_path / "giver.safetensors")
    known = memory.network_inputs(observations("gait")[1], ())
    places = [memory.network_inputs(layout, ()).index(name) for name in known]
    acted = heir.actor(torch.from_numpy(seen))
    torch.testing.assert_close(acted[:, :4], giver.actor(torch.from_numpy(seen[:, places])))
    assert not acted[:, 4:].any()


def test_a_beginning_is_a_controller_of_a_task_or_a_policy():
    for values in ({}, {"controller": "heading control"}, {"policy": "a", "task": "b"}):
        with pytest.raises(ValueError, match=r"behaviour_cloning = .*: expected controller and task, a policy"):
            config.parse(config.PpoConfig, {"behaviour_cloning": values})


def test_a_planar_policy_is_taken_over_in_3d():
    """On the same fields both begin with the same commands, although the ranges of the actions differ."""
    keywords = {"difficulty": 1.0, "action_mode": "residual", "nearest_pegs": 8, "perception": "body"}
    general, giver = load_policy("general"), rollout.make_env("SnakeField-v1", 5, 1, **keywords)
    heir = rollout.make_env("SnakeSpatial-v1", 5, 1, task="field", **keywords)
    (flat, _), (spatial, _) = (env.reset(seed=seeds.selection(5)) for env in (giver, heir))
    planar, layout = giver.unwrapped.layout, heir.unwrapped.layout
    general.begin(planar, 5)
    times = tuple(memory.time_constants(general.config))
    networks = config.PpoNetworks(hidden=(128, 128), memory=times, symmetric=True)
    run = config.PpoConfig(env_id="SnakeSpatial-v1", env=keywords | {"task": "field"}, policy=networks)
    actor_critic = agent.make_agent(run, len(memory.network_inputs(layout, times)), len(layout["action"]))
    behaviour_cloning.take_over(actor_critic, layout, times, policy_path("general"))
    seen = torch.from_numpy(memory.MemoryTraces(layout, times, 5)(spatial))
    with torch.no_grad():
        acted = commands(actor_critic.actor(seen).numpy(), layout)
    for name, value in commands(general(flat), planar).items():
        np.testing.assert_allclose(acted[name.replace("joint_", "yaw_")], value, atol=1e-5)
    assert not acted["lift"].any()
    assert not acted["pitch_offset_5"].any()


def commands(action, layout):
    """Physical values of an action by name."""
    scaled = [
        (entry["name"], 0.5 * (entry["high"] - entry["low"]), 0.5 * (entry["high"] + entry["low"]))
        for entry in layout["action"]
    ]
    return {name: centre + half * action[:, k] for k, (name, half, centre) in enumerate(scaled)}
