"""RLlib's learner over the native batch, on a local cluster of two nodes; what it learned plays with NumPy."""

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("ray.rllib")

import gymnasium as gym
import torch

from experiments.distributed import rllib
from snake_env.policies import files
from snake_env.policies.network import Network
from training import config
from training.runs import RunFolder

SMOKE = config.load_as(rllib.RllibConfig, "smoke").with_changes(total_steps=1024)


@pytest.fixture(scope="module")
def run(cluster, tmp_path_factory):
    """A finished run of 1,024 steps, gone on with up to 1,536."""
    out = tmp_path_factory.mktemp("rllib")
    arguments = ["--out", str(out / "run"), "--config", "smoke", "--no-bar", "--runners", "2"]
    assert rllib.main([*arguments, "--total-steps", "1024"]) == 0
    assert rllib.main([*arguments, "--total-steps", "1536", "--resume"]) == 0
    return RunFolder(out / "run")


def test_a_run_goes_on_where_it_ended(run):
    steps = [row["steps"] for row in run.read_curve()]
    assert steps == [256, 512, 768, 1024, 1280, 1536]
    assert Network(run.policy).config["steps"] == 1536


@pytest.fixture(scope="module")
def trained(cluster):
    """RLlib's algorithm after three updates, and what it said of each."""
    algorithm = rllib.settings(SMOKE, 2).build_algo()
    yield algorithm, [algorithm.train()["env_runners"] for _ in range(3)]
    algorithm.stop()


def test_no_step_of_an_episode_is_lost(trained):
    lengths = {row[key] for row in trained[1] for key in ("episode_len_min", "episode_len_max") if key in row}
    assert lengths == {40}, "fields of 40 control periods end on time alone"


def test_numpy_plays_the_actor_that_rllib_trained(trained, tmp_path):
    module = trained[0].get_module()
    files.write(tmp_path / files.NAME, rllib.actor(module.get_state()), SMOKE.model_dump(mode="json"))
    env = gym.make_vec(SMOKE.env_id, num_envs=16, **SMOKE.env)
    observation, _ = env.reset(seed=5)
    env.close()
    with torch.no_grad():
        mean = module.forward_inference({"obs": torch.from_numpy(observation)})["action_dist_inputs"][:, :4].numpy()
    played = Network(tmp_path / files.NAME)(observation)
    np.testing.assert_allclose(played, np.clip(mean, -1.0, 1.0), rtol=1e-5, atol=1e-6)
    assert np.ptp(played, axis=0).min() > 0.0


def test_layers_come_in_the_order_of_the_module():
    weights = {
        "encoder.actor_encoder.net.mlp.0.weight": torch.ones(2, 3),
        "encoder.actor_encoder.net.mlp.0.bias": torch.zeros(2),
        "encoder.actor_encoder.net.mlp.2.weight": torch.ones(4, 2),
        "encoder.actor_encoder.net.mlp.2.bias": torch.zeros(4),
        "encoder.critic_encoder.net.mlp.0.weight": torch.ones(9, 3),
        "pi.net.mlp.0.weight": torch.ones(1, 4),
        "pi.net.mlp.0.bias": torch.zeros(1),
    }
    shapes = {name: array.shape for name, array in rllib.actor(weights).items() if name.endswith("weight")}
    assert shapes == {"actor.0.weight": (2, 3), "actor.1.weight": (4, 2), "actor.2.weight": (1, 4)}


@pytest.mark.parametrize(
    ("changed", "runners", "message"),
    [
        ({}, 3, "runners = 3: expected a divisor of num_envs = 8"),
    ],
)
def test_what_rllib_does_not_have_is_refused(changed, runners, message):
    with pytest.raises(ValueError, match=message):
        rllib.settings(SMOKE.with_changes(**changed), runners)
