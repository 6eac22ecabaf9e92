"""RLlib on native batches; runs in the environment of `make test-ray`."""

from __future__ import annotations

import numpy as np
import pytest

import snake_env
from snake_env.__main__ import main
from snake_env.policies import rllib_module

torch = pytest.importorskip("torch")
pytest.importorskip("ray.rllib")


def test_rllib_learns_from_a_batch_and_other_commands_take_its_policy(tmp_path, monkeypatch, capsys):
    out, seen, means = (
        tmp_path / "mine.safetensors",
        np.linspace(-1.0, 1.0, 5 * 63, dtype=np.float32).reshape(5, 63),
        [],
    )

    def save(algorithm, path, card, write=rllib_module.save):
        found = algorithm.get_module().forward_inference({"obs": torch.from_numpy(seen)})
        means.append(found["action_dist_inputs"].detach().numpy()[:, :4])
        return write(algorithm, path, card)

    monkeypatch.setattr(rllib_module, "save", save)
    arguments = ["--ray", "0", "--num-envs", "4", "--steps", "256", "--options", '{"difficulty": 0.2}']
    assert main(["train", *arguments, "--out", str(out)]) == 0
    assert "256 steps" in capsys.readouterr().out
    policy = snake_env.load_policy(out)
    np.testing.assert_allclose(policy(seen), means[0], atol=1e-5)
    assert (policy.card.env_id, policy.card.env_options) == ("SnakeField-v1", {"difficulty": 0.2})


@pytest.mark.timeout(900)  # processes start slowly on a busy machine
def test_tune_compares_settings_each_with_a_remote_runner(tmp_path):
    """The settings are a trainable of Tune: two trials in processes of their own, each with a batch in one more."""
    ray = pytest.importorskip("ray")
    tune = pytest.importorskip("ray.tune")
    config = snake_env.rllib.settings(runners=1, num_envs=4, steps=16, difficulty=0.2)
    space = config.training(lr=tune.grid_search([1e-4, 1e-3]))
    ray.shutdown()  # of what an earlier test has begun
    ray.init(num_cpus=4, include_dashboard=False, log_to_driver=False)
    try:
        run = tune.RunConfig(stop={"training_iteration": 2}, storage_path=str(tmp_path), verbose=0)
        trials = tune.Tuner(config.algo_class, param_space=space, run_config=run).fit()
    finally:
        ray.shutdown()
    assert not trials.errors, trials.errors
    assert [trial.config["lr"] for trial in trials] == [1e-4, 1e-3]
    for trial in trials:
        assert trial.metrics["num_env_steps_sampled_lifetime"] == 2 * 4 * 16
