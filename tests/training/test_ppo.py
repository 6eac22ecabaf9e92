"""The lean learner learns, repeats itself, resumes, and leaves policies that NumPy alone can play."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

import snake_env
from training import config, rollout, runs, seeds
from training.evaluation import evaluate
from training.learners import ppo, sb3
from training.policies import GaitParameters, Network, files

SMOKE = ["--config", "smoke", "--no-bar"]


def folder(path):
    return runs.RunFolder(path, ppo.POLICY, ".pt")


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A finished run of 4096 steps."""
    out = tmp_path_factory.mktemp("lean")
    assert ppo.main(["--out", str(out), *SMOKE]) == 0
    return folder(out)


def test_a_run_leaves_everything_needed_to_judge_it(trained):
    assert trained.finished
    assert trained.config() == config.load("smoke")
    assert [row["steps"] for row in trained.read_curve()] == list(range(256, 4097, 256))
    assert {"return", "is_success", "distance", "speed"} <= set(trained.read_curve()[-1])


def test_a_budget_of_steps_repeats_itself_bit_for_bit(trained, tmp_path):
    assert ppo.main(["--out", str(tmp_path / "again"), *SMOKE]) == 0
    assert ppo.main(["--out", str(tmp_path / "other"), *SMOKE, "--seed", "1"]) == 0
    runs = (trained.path, tmp_path / "again", tmp_path / "other")
    first, again, other = (files.read(path / ppo.POLICY)[0] for path in runs)
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not np.array_equal(first["actor.0.weight"], other["actor.0.weight"])


def test_resuming_goes_on_from_the_latest_checkpoint(tmp_path):
    assert ppo.main(["--out", str(tmp_path / "run"), *SMOKE, "--total-steps", "1024"]) == 0
    arguments = ["--out", str(tmp_path / "run"), "--resume", "--no-bar", "--total-steps", "2048"]
    assert ppo.main(arguments) == 0
    assert [row["steps"] for row in folder(tmp_path / "run").read_curve()] == list(range(256, 2049, 256))
    assert folder(tmp_path / "run").latest().stem == "000002048"


def test_a_finished_folder_is_not_overwritten(trained, capsys):
    assert ppo.main(["--out", str(trained.path), *SMOKE]) == 2
    assert "--resume" in capsys.readouterr().err


def test_a_budget_of_seconds_ends_the_run(tmp_path):
    assert ppo.main(["--out", str(tmp_path / "run"), *SMOKE, "--total-steps", "100000000", "--seconds", "1"]) == 0
    assert json.loads((tmp_path / "run" / "finished.json").read_text())["seconds"] < 20


def test_numpy_plays_what_torch_has_learnt(trained):
    """The same network twice: actions agree to single precision."""
    learner = ppo.Learner(trained.config(), 0, lambda *episode: None)
    learner.restore(trained.latest())
    observation = np.random.default_rng(0).uniform(-1, 1, (5, learner.collector.observations)).astype(np.float32)
    with torch.no_grad():
        mean = learner.agent.actor(torch.from_numpy(observation)).numpy()
    np.testing.assert_allclose(Network(trained.model)(observation), mean, rtol=1e-5, atol=1e-6)


def test_an_episode_does_not_depend_on_the_size_of_its_batch(trained):
    """A film plays one robot of the many that were scored."""
    policy = Network(trained.model)
    options = {"difficulty": 1.0, "max_episode_steps": 200}
    together = rollout.run_episodes(policy, "SnakeField-v0", seeds.selection(40), 1, **options)
    for k in (0, 17):
        alone = rollout.run_episodes(policy, "SnakeField-v0", [seeds.selection(40)[k]], 1, **options)
        assert alone["distance"][0] == together["distance"][k]


def test_a_policy_file_is_one_that_others_read(trained):
    """Header, alignment and metadata as safetensors has them; the configuration comes back."""
    arrays, found = files.read(trained.model)
    assert config.Config.from_mapping({key: found[key] for key in found if key != "steps"}) == trained.config()
    content = trained.model.read_bytes()
    size = int.from_bytes(content[:8], "little")
    assert size % 8 == 0
    assert len(content) == 8 + size + sum(array.nbytes for array in arrays.values())


def test_broken_policy_files_are_named(tmp_path):
    path = tmp_path / "broken.safetensors"
    path.write_bytes(b"no such thing")
    with pytest.raises(ValueError, match=r"broken\.safetensors: expected a safetensors file"):
        Network(path)
    files.write(path, {"critic.0.weight": np.zeros((2, 2), np.float32)}, {})
    with pytest.raises(ValueError, match="expected arrays actor"):
        Network(path)


def test_evaluation_plays_lean_policies(trained, tmp_path, capsys):
    arguments = ["--policy", str(trained.model), "--fields", "3", "--out", str(tmp_path)]
    assert evaluate.main([*arguments, "--options", '{"max_episode_steps": 20}']) == 0
    assert trained.path.name in capsys.readouterr().out


def test_a_policy_is_judged_where_it_was_trained_unless_asked_otherwise(trained):
    assert evaluate.task(None, {}, [trained.model]) == ("SnakeField-v0", {"max_episode_steps": 40})
    assert evaluate.task(None, {"difficulty": 1.0}, [trained.model])[1] == {"max_episode_steps": 40, "difficulty": 1.0}
    assert evaluate.task("SnakeFree-v0", {}, [trained.model]) == ("SnakeFree-v0", {})
    assert evaluate.task(None, {}, []) == ("SnakeField-v0", {})


def test_the_difficulty_grows_with_the_budget_that_is_used():
    settings = config.Config(curriculum=0.5)
    assert [settings.difficulty(used, 0.8) for used in (0.0, 0.25, 0.5, 1.0)] == [0.0, 0.4, 0.8, 0.8]
    assert config.Config().difficulty(0.0, 0.8) == 0.8
    with pytest.raises(ValueError, match=r"curriculum = 2\.0: expected a number in \[0, 1\]"):
        config.Config(curriculum=2.0)


@pytest.mark.parametrize("learner", ["lean", "SB3"])
def test_a_curriculum_reaches_the_environment(learner, tmp_path, monkeypatch):
    given = []
    monkeypatch.setattr(
        snake_env.SnakeVectorEnv, "set_difficulty", lambda env, difficulty, mask=None: given.append(difficulty)
    )
    settings = dataclasses.replace(config.load("smoke"), curriculum=0.5, total_steps=1024, env={"difficulty": 1.0})
    train, model, suffix = (ppo.train, ppo.POLICY, ".pt") if learner == "lean" else (sb3.train, "model.zip", ".zip")
    run = runs.RunFolder(tmp_path, model, suffix)
    run.create(settings)
    assert train(run, settings, False) == 0
    assert given[0] == 0.0
    assert given[-1] == 1.0
    assert given == sorted(given)


def test_advantages_are_discounted_sums_of_errors():
    """Two robots, three steps, one end: compared with the sums written out."""
    settings = dataclasses.replace(config.Ppo(), gamma=0.9, gae_lambda=0.5)
    played = ppo.Rollout(3, 2, 1, 1)
    played.reward[:] = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    played.value[:] = torch.tensor([[0.5, 0.1], [0.2, 0.3], [0.4, 0.6]])
    played.done[1, 1] = True
    advantage, target = (x.reshape(3, 2).numpy() for x in played.advantages(torch.tensor([2.0, 3.0]), settings))
    error = np.array(
        [[1 + 0.9 * 0.2 - 0.5, 2 + 0.9 * 0.3 - 0.1], [3 + 0.9 * 0.4 - 0.2, 4 - 0.3], [5 + 1.8 - 0.4, 6 + 2.7 - 0.6]]
    )
    expected = error.copy()
    expected[1, 0] += 0.45 * expected[2, 0]
    expected[0] += 0.45 * expected[1]
    np.testing.assert_allclose(advantage, expected, rtol=1e-6)
    np.testing.assert_allclose(target, expected + played.value.numpy(), rtol=1e-6)


def test_a_last_batch_of_one_sample_is_learnt_from():
    """Five samples in batches of four: the one that is left over has no spread to be scaled by."""
    torch.manual_seed(0)
    agent = ppo.Agent(3, 2, config.Policy((8,)), None)
    played = ppo.Rollout(5, 1, 3, 2)
    played.observation.normal_()
    played.action.normal_()
    with torch.no_grad():
        played.log_density[:] = agent.log_density(played.observation, played.action)
    optimiser = torch.optim.Adam(agent.parameters())
    before = [parameter.detach().clone() for parameter in agent.parameters()]
    settings = dataclasses.replace(config.Ppo(), batch_size=4, n_epochs=2)
    ppo.update(agent, optimiser, played, (torch.randn(5), torch.randn(5)), settings, np.random.default_rng(0))
    assert all(torch.isfinite(parameter).all() for parameter in agent.parameters())
    assert not any(torch.equal(*pair) for pair in zip(before, agent.parameters(), strict=True))


def test_density_is_that_of_the_normal_law():
    agent = ppo.Agent(3, 2, config.Policy((8,), -0.3), None)
    observation, action = torch.randn(4, 3), torch.randn(4, 2)
    law = torch.distributions.Normal(agent.actor(observation), agent.log_std.exp())
    torch.testing.assert_close(agent.log_density(observation, action), law.log_prob(action).sum(-1))
    torch.testing.assert_close(agent.entropy(), law.entropy()[0].sum())
    drawn, density = agent.act(observation, torch.Generator().manual_seed(0))
    torch.testing.assert_close(density, agent.log_density(observation, drawn))


def test_it_learns_to_go_faster_on_open_ground(tmp_path):
    """Ground that is slippery lengthways rewards a quicker wave: 40,000 steps double the untrained distance.

    On 20 fields for choosing, for 8 s; untrained action zero is the thesis's gait.
    """
    settings = dataclasses.replace(
        config.Config(env_id="SnakeFree-v0", env={"max_episode_steps": 160}, num_envs=32, num_threads=1),
        total_steps=40_960,
        ppo=dataclasses.replace(config.Ppo(), n_steps=32, batch_size=256, learning_rate=1e-3),
        policy=config.Policy(hidden=(32,), log_std=-0.7),
    )
    run = folder(tmp_path / "run")
    run.create(settings)
    assert ppo.train(run, settings, show=False) == 0
    learnt = rollout.run_episodes(Network(run.model), "SnakeFree-v0", seeds.selection(20), 1, max_episode_steps=160)
    gait = evaluate.gait_policy(GaitParameters(), "SnakeFree-v0")
    still = rollout.run_episodes(gait, "SnakeFree-v0", seeds.selection(20), 1, max_episode_steps=160)
    assert learnt["speed"].mean() > 2.0 * still["speed"].mean() > 0.0


def test_it_needs_no_package_beyond_torch_and_numpy():
    """Training and playing work where Stable-Baselines3, yaml and matplotlib cannot be imported."""
    code = (
        "import sys; sys.modules.update(dict.fromkeys(('stable_baselines3', 'yaml', 'matplotlib')));"
        "import training.learners.ppo, training.policies, training.rollout; from training import config;"
        "config.load('field-hard')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
