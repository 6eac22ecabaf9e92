"""The learner ppo is the PPO of Stable-Baselines3: from the same weights and draws both reach the same weights."""

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from torch import nn

import snake_env.sb3
from snake_env.evaluation import seeds
from training import config
from training.learners import ppo

UPDATES = 2
HIDDEN = (16, 8)
STEPS, ROBOTS = 32, 8
ENV = {"max_episode_steps": 40, "goal_distance": 0.1, "difficulty": 1.0, "integrator": {"order": 1}}
"""Equal steps, whose lengths do not depend on round-off. Episodes end within a rollout, some at the goal and some
because time is up."""
ROUND_OFF = 1e-4
"""Bound of a layer's difference, relative to what it has learned: Adam divides the round-off of a weight by the size of
its gradient, so that of a single weight has none. Both learners differ by up to 1.3e-5, depending on the processor."""


@pytest.fixture
def settings():
    """A run whose learning rate does not depend on the budget, in which gradients and probabilities are clipped."""
    smoke = config.load("smoke", "ppo")
    return smoke.with_changes(
        env=ENV,
        num_envs=ROBOTS,
        policy=smoke.policy.with_changes(hidden=HIDDEN, log_std=-0.5),
        ppo=smoke.ppo.with_changes(
            n_steps=STEPS, batch_size=64, n_epochs=3, learning_rate=3e-3, final_learning_rate=1.0, ent_coef=0.01
        ),
    )


class SameOrder:
    """Orders samples (step, robot) as Stable-Baselines3 orders its samples (robot, step)."""

    def __init__(self):
        self._draws = np.random.RandomState(0)

    def permutation(self, count):
        robot, step = np.divmod(self._draws.permutation(count), STEPS)
        return step * ROBOTS + robot


def layers(network):
    return [layer for layer in network.modules() if isinstance(layer, nn.Linear)]


def of_sb3(policy):
    """The layers of actor and critic, in the order of an agent's."""
    return [
        *layers(policy.mlp_extractor.policy_net),
        policy.action_net,
        *layers(policy.mlp_extractor.value_net),
        policy.value_net,
    ]


def test_same_draws_same_weights(settings, monkeypatch):
    values = settings.ppo.model_dump(exclude={"final_learning_rate"})
    env = snake_env.sb3.make(settings.env_id, ROBOTS, num_threads=1, **ENV)
    env.seed(seeds.training(settings.seed, 0, ROBOTS))
    model = PPO(
        "MlpPolicy", env, device="cpu", policy_kwargs={"net_arch": list(HIDDEN), "log_std_init": -0.5}, **values
    )
    ended = []
    learner = ppo.Learner(settings, 0, lambda returned, signals: ended.append(signals["is_success"]))
    learner.rng = SameOrder()
    ours = [*layers(learner.agent.actor), *layers(learner.agent.critic)]
    with torch.no_grad():
        for own, other in zip(ours, of_sb3(model.policy), strict=True):
            own.weight.copy_(other.weight)
            own.bias.copy_(other.bias)
    begun = [{"weight": own.weight.clone(), "bias": own.bias.clone()} for own in ours]

    for _ in range(UPDATES):
        learner.collect()
        learner.learn(0.0)
    learner.close()

    noise = torch.Generator().manual_seed(settings.seed)
    monkeypatch.setattr(
        torch.distributions.normal, "_standard_normal", lambda shape, **_: torch.empty(shape).normal_(generator=noise)
    )
    np.random.seed(0)  # noqa: NPY002 - Stable-Baselines3 draws from it
    model.learn(UPDATES * STEPS * ROBOTS)
    env.close()

    assert 0 < sum(ended) < len(ended), "some episodes end at the goal, some because time is up"
    log_std = learner.agent.log_std.detach()
    assert (log_std - model.policy.log_std).norm() < ROUND_OFF * (log_std - settings.policy.log_std).norm()
    for own, other, before in zip(ours, of_sb3(model.policy), begun, strict=True):
        for name in ("weight", "bias"):
            learned = (getattr(own, name) - before[name]).norm()
            assert learned > 1e-2, "it has learned"
            assert (getattr(own, name) - getattr(other, name)).norm() < ROUND_OFF * learned
