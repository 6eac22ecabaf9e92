"""Robots shared among Ray actors do what they do in one process; on a local cluster of two nodes."""

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("ray")

import torch

from experiments.distributed import ppo as distributed_ppo
from experiments.distributed.collector import RayCollector
from snake_env.policies import files
from training import config
from training.learners import agent as agents
from training.learners.collector import Collector

SMOKE = config.load("smoke", "ppo").with_changes(total_steps=512)


def test_actors_begin_with_the_robots_of_one_process(cluster):
    shared = RayCollector(SMOKE, 5, 0.0, lambda *episode: None, workers=2)
    alone = Collector(SMOKE, 5, 0.0, lambda *episode: None)
    agent = agents.Agent(alone.observations, alone.actions, SMOKE.policy, None)
    noise = torch.Generator().manual_seed(0)
    together, last_value = shared.collect(agent, noise, 0.99)
    apart, _ = alone.collect(agent, noise, 0.99)
    assert torch.equal(together.observation[0], apart.observation[0])
    assert last_value.shape == (SMOKE.num_envs,)
    with torch.no_grad():
        torch.testing.assert_close(together.value, agent.value(together.observation))
    shared.close()


def test_training_on_two_nodes_repeats_itself(cluster, tmp_path):
    for name in ("first", "second"):
        arguments = ["--out", str(tmp_path / name), "--config", "smoke", "--no-bar", "--total-steps", "512"]
        assert distributed_ppo.main([*arguments, "--workers", "2"]) == 0
    first, second = (files.read(tmp_path / name / files.NAME)[0] for name in ("first", "second"))
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_robots_are_shared_evenly(cluster):
    with pytest.raises(ValueError, match="workers = 3: expected a divisor of num_envs = 8"):
        RayCollector(SMOKE, 0, 0.0, lambda *episode: None, workers=3)
