"""The learner ppo learns, repeats itself, resumes, and leaves policies that NumPy alone can play."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("torch")

import safetensors.numpy
import torch
from torch import nn

import snake_env
from snake_env.__main__ import main
from snake_env.evaluation import rollout, seeds
from snake_env.policies import GaitParameters, GaitPolicy, Network, files
from training import config, evaluate, progress, runs, train
from training.evaluation import loading
from training.learners import agent, clipped_adam, ppo, sb3
from training.learners.collector import Rollout

SMOKE = ["--config", "smoke", "--no-bar"]


def folder(path):
    return runs.RunFolder(path)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A finished run of 4096 steps."""
    out = tmp_path_factory.mktemp("ppo")
    assert train.main(["--learner", "ppo", "--out", str(out), *SMOKE]) == 0
    return folder(out)


def test_a_run_leaves_everything_needed_to_judge_it(trained):
    assert trained.finished
    assert trained.config() == config.load("smoke", "ppo")
    assert [row["steps"] for row in trained.read_curve()] == list(range(256, 4097, 256))
    assert {"return", "is_success", "distance", "speed"} <= set(trained.read_curve()[-1])


def test_a_budget_of_steps_repeats_itself_bit_for_bit(trained, tmp_path):
    assert train.main(["--learner", "ppo", "--out", str(tmp_path / "again"), *SMOKE]) == 0
    assert train.main(["--learner", "ppo", "--out", str(tmp_path / "other"), *SMOKE, "--seed", "1"]) == 0
    runs = (trained.path, tmp_path / "again", tmp_path / "other")
    first, again, other = (files.read(path / files.NAME)[0] for path in runs)
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not np.array_equal(first["actor.0.weight"], other["actor.0.weight"])


def stop_at(monkeypatch, steps):
    """The next run gets a signal in the rollout after so many steps."""
    collect = ppo.Learner.collect

    def stopping(learner):
        collect(learner)
        if learner.steps == steps:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(ppo.Learner, "collect", stopping)


MEMORY = ["--policy.memory", "0.2", "--policy.symmetric", "--curriculum", "0.5"]
"""Everything that a checkpoint has to keep."""


def test_a_run_that_was_stopped_ends_as_one_that_was_not(tmp_path, monkeypatch):
    """Networks, optimiser, robots in the middle of their episodes, memory and random states go on bit for bit."""
    arguments = ["--learner", "ppo", *SMOKE, *MEMORY]
    assert train.main([*arguments, "--out", str(tmp_path / "whole")]) == 0
    with monkeypatch.context() as patch:
        stop_at(patch, 1280)
        assert train.main([*arguments, "--out", str(tmp_path / "parts")]) == 130
    assert train.main(["--learner", "ppo", "--out", str(tmp_path / "parts"), "--resume", "--no-bar"]) == 0
    whole, parts = folder(tmp_path / "whole"), folder(tmp_path / "parts")
    first, second = (files.read(one.policy)[0] for one in (whole, parts))
    assert all(np.array_equal(first[name], second[name]) for name in first)
    timing = ("seconds", "steps_per_second")
    for row, other in zip(whole.read_curve(), parts.read_curve(), strict=True):
        assert {key: row[key] for key in row if key not in timing} == {
            key: other[key] for key in other if key not in timing
        }
    assert (whole.path / "evaluations.jsonl").read_text() == (parts.path / "evaluations.jsonl").read_text()
    assert whole.best.read_bytes() == parts.best.read_bytes()


def test_diagnostics_are_what_their_names_mean():
    """A first gradient step has moved nothing; what the critic explains is one less the share it misses."""
    torch.manual_seed(0)
    actor_critic = agent.Agent(3, 2, config.PpoNetworks(hidden=(8,)), None)
    played = Rollout(6, 1, 3, 2)
    played.observation.normal_()
    played.action.normal_()
    target = torch.randn(6)
    with torch.no_grad():
        played.log_density[:] = actor_critic.log_density(played.observation, played.action)
        played.value[:] = (0.5 * target)[:, None]
    optimiser = clipped_adam.ClippedAdam(actor_critic)
    settings = config.Ppo(batch_size=6, n_epochs=1)
    found = ppo.update(actor_critic, optimiser, played, (torch.randn(6), target), settings, np.random.default_rng(0))
    assert found["train/approx_kl"] == pytest.approx(0.0, abs=1e-6)
    assert found["train/clip_fraction"] == 0.0
    assert found["train/explained_variance"] == pytest.approx(0.75, rel=1e-5)
    assert found["train/gradient_steps"] == 1.0
    law = torch.distributions.Normal(torch.zeros(2), torch.full((2,), np.exp(-1.0)))
    assert found["train/entropy_loss"] == pytest.approx(-float(law.entropy().sum()), abs=0.01)  # after one step
    many = config.Ppo(batch_size=6, n_epochs=50, clip_range=0.05, learning_rate=0.1)
    played.log_density -= 1.0  # ratios are e
    found = ppo.update(actor_critic, optimiser, played, (torch.randn(6), target), many, np.random.default_rng(0))
    assert found["train/clip_fraction"] > 0.5
    assert found["train/approx_kl"] > 0.1


def test_the_loss_is_that_of_the_clipped_surrogate_objective():
    """Against the sums of Schulman et al. (2017) written out, of three samples, one of which is clipped."""
    torch.manual_seed(0)
    actor_critic = agent.Agent(3, 2, config.PpoNetworks(hidden=(8,)), None)
    observation, action = torch.randn(3, 3), torch.randn(3, 2)
    log_prob, value = (one.detach() for one in actor_critic(observation, action))
    log_ratio, advantages, returns = torch.tensor([0.0, 0.1, 0.5]), torch.tensor([1.0, -1.0, 2.0]), torch.randn(3)
    batch = ppo.Minibatch(observation, action, log_prob - log_ratio, returns, advantages, 1.0 / 3.0)
    settings = config.Ppo(clip_range=0.2, vf_coef=0.7, ent_coef=0.01)
    with torch.no_grad():
        loss, terms = ppo.losses(actor_critic, batch, settings)
    ratio = np.exp([0.0, 0.1, 0.5])
    policy_loss = -np.mean([1.0, -ratio[1], 2.0 * 1.2])
    value_loss = np.mean(np.square((value - returns).numpy()))
    assert float(terms["policy_gradient_loss"]) == pytest.approx(policy_loss, rel=1e-5)
    assert float(terms["value_loss"]) == pytest.approx(value_loss, rel=1e-5)
    assert float(terms["approx_kl"]) == pytest.approx(np.mean(ratio - 1.0 - [0.0, 0.1, 0.5]), rel=1e-4)
    assert float(terms["clip_fraction"]) == pytest.approx(1.0 / 3.0)
    entropy = actor_critic.entropy().item()
    assert float(loss) == pytest.approx(policy_loss + 0.7 * value_loss - 0.01 * entropy, rel=1e-5)


def test_an_update_ends_when_the_policy_has_moved_too_far():
    """A first step is always taken; ratios of e are beyond any target."""
    actor_critic = agent.Agent(3, 2, config.PpoNetworks(hidden=(8,)), None)
    played, targets = Rollout(6, 1, 3, 2), (torch.randn(6), torch.randn(6))
    with torch.no_grad():
        played.log_density[:] = actor_critic.log_density(played.observation, played.action)
    settings = config.Ppo(batch_size=6, n_epochs=50, learning_rate=0.1, target_kl=0.01)
    steps = []
    for _ in range(2):
        optimiser = clipped_adam.ClippedAdam(actor_critic)
        found = ppo.update(actor_critic, optimiser, played, targets, settings, np.random.default_rng(0))
        steps.append(found["train/gradient_steps"])
        played.log_density -= 1.0
    assert 1.0 <= steps[0] <= 50.0
    assert steps[1] == 0.0


def test_the_best_policy_of_a_run_is_kept(tmp_path, monkeypatch):
    """Of three evaluations the second scores highest: its policy stays."""
    merits = iter([0.1, 0.9, 0.5])

    def scores(policy, config, fields, signals):
        means = dict.fromkeys(signals, next(merits))
        return means, {"": means}

    monkeypatch.setattr(progress, "means_over_tasks", scores)
    arguments = ["--learner", "ppo", *SMOKE, "--evaluations", "3", "--total-steps", "768"]
    assert train.main([*arguments, "--out", str(tmp_path)]) == 0
    run = folder(tmp_path)
    assert files.read(run.best)[1]["steps"] == 512
    rows = [json.loads(line) for line in (tmp_path / "evaluations.jsonl").read_text().splitlines()]
    assert [(row["steps"], row["is_success"]) for row in rows] == [(256, 0.1), (512, 0.9), (768, 0.5)]
    assert not (tmp_path / "candidate.safetensors").exists()


def test_a_run_may_be_tracked_or_not(trained, tmp_path):
    assert list((trained.path / "tensorboard").glob("events*"))
    few = ["--total-steps", "256", "--track", "none"]
    assert train.main(["--learner", "ppo", "--out", str(tmp_path / "quiet"), *SMOKE, *few]) == 0
    assert not (tmp_path / "quiet" / "tensorboard").exists()


def test_a_run_begins_from_another_that_it_trains_first(tmp_path, capsys):
    path = tmp_path / "first.json"
    first = config.load("smoke", "ppo").with_changes(total_steps=512)
    config.save(first, path)
    second = tmp_path / "second.json"
    cloning = config.BehaviourCloning(run=str(path), critic_rounds=1)
    config.save(first.with_changes(behaviour_cloning=cloning, total_steps=1024), second)
    out = tmp_path / "run"
    assert train.main(["--config", str(second), "--seed", "3", "--no-bar", "--out", str(out)]) == 0
    before, after = folder(out / "before"), folder(out)
    assert before.finished
    assert before.config().seed == 3
    assert files.read(after.policy)[1]["behaviour_cloning"]["run"] == str(path), "no path of this machine"
    assert after.read_curve()[0]["steps"] == 512, "256 steps for the critic, 256 for the first update"


def test_numpy_plays_what_torch_has_learnt(trained):
    """The same network twice: actions agree to single precision."""
    learner = ppo.Learner(trained.config(), 0, lambda *episode: None)
    learner.restore(trained.latest())
    observation = np.random.default_rng(0).uniform(-1, 1, (5, learner.collector.observations)).astype(np.float32)
    with torch.no_grad():
        mean = learner.agent.actor(torch.from_numpy(observation)).numpy()
    np.testing.assert_allclose(Network(trained.policy)(observation), mean, rtol=1e-5, atol=1e-6)


def test_an_episode_does_not_depend_on_the_size_of_its_batch(trained):
    """A film plays one robot of the many that were scored."""
    policy = Network(trained.policy)
    options = {"difficulty": 1.0, "max_episode_steps": 200}
    together = rollout.run_episodes(policy, "SnakeField-v1", seeds.selection(40), 1, **options)
    for k in (0, 17):
        alone = rollout.run_episodes(policy, "SnakeField-v1", [seeds.selection(40)[k]], 1, **options)
        assert alone["distance"][0] == together["distance"][k]


def test_a_policy_file_is_one_that_others_read(trained):
    """Arrays as safetensors has them; the configuration comes back."""
    arrays, found = files.read(trained.policy)
    assert config.parse(config.PpoConfig, {key: found[key] for key in found if key != "steps"}) == trained.config()
    others = safetensors.numpy.load_file(trained.policy)
    assert all(np.array_equal(arrays[name], others[name]) for name in others)


def test_broken_policy_files_are_named(tmp_path):
    path = tmp_path / "broken.safetensors"
    path.write_bytes(b"no such thing")
    with pytest.raises(ValueError, match=r"broken\.safetensors: expected a safetensors file"):
        Network(path)
    files.write(path, {"critic.0.weight": np.zeros((2, 2), np.float32)}, {})
    with pytest.raises(ValueError, match="expected arrays actor"):
        Network(path)


def test_evaluation_plays_policies_of_ppo(trained, tmp_path, capsys):
    arguments = ["--policy", str(trained.policy), "--fields", "3", "--out", str(tmp_path)]
    assert evaluate.main([*arguments, "--options", '{"max_episode_steps": 20}']) == 0
    assert trained.path.name in capsys.readouterr().out


def test_a_policy_is_judged_where_it_was_trained_unless_asked_otherwise(trained):
    assert loading.task(None, {}, [trained.policy]) == ("SnakeField-v1", {"max_episode_steps": 40})
    assert loading.task(None, {"difficulty": 1.0}, [trained.policy])[1] == {"max_episode_steps": 40, "difficulty": 1.0}
    assert loading.task("SnakeFree-v1", {}, [trained.policy]) == ("SnakeFree-v1", {})
    assert loading.task(None, {}, []) == ("SnakeField-v1", {})


def test_models_of_the_command_line_name_their_task(tmp_path):
    out = tmp_path / "mine.zip"
    options = ["--options", '{"max_episode_steps": 5}']
    assert main(["train", "--task", "maze", "--steps", "64", "--num-envs", "1", "--out", str(out), *options]) == 0
    env_id, keywords = loading.task(None, {}, [out])
    assert (env_id, keywords["max_episode_steps"]) == ("SnakeMaze-v1", 5)


def test_the_difficulty_grows_with_the_budget_that_is_used():
    settings = config.PpoConfig(curriculum=0.5)
    assert [settings.difficulty(used, 0.8) for used in (0.0, 0.25, 0.5, 1.0)] == [0.0, 0.4, 0.8, 0.8]
    assert config.PpoConfig().difficulty(0.0, 0.8) == 0.8
    with pytest.raises(ValueError, match="less than or equal to 1"):
        config.PpoConfig(curriculum=2.0)


@pytest.mark.parametrize("learner", ["ppo", "sb3"])
def test_a_curriculum_reaches_the_environment(learner, tmp_path, monkeypatch):
    given = []
    monkeypatch.setattr(
        snake_env.SnakeVectorEnv, "set_difficulty", lambda env, difficulty, mask=None: given.append(difficulty)
    )
    settings = config.load("smoke", learner).with_changes(curriculum=0.5, total_steps=1024, env={"difficulty": 1.0})
    run = runs.RunFolder(tmp_path)
    run.create(settings)
    assert {"ppo": ppo, "sb3": sb3}[learner].train(run, settings, False) == 0
    assert given[0] == 0.0
    assert given[-1] == 1.0
    assert given == sorted(given)


def test_advantages_are_discounted_sums_of_errors():
    """Two robots, three steps, one end: compared with the sums written out."""
    settings = config.Ppo(gamma=0.9, gae_lambda=0.5)
    played = Rollout(3, 2, 1, 1)
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


def test_an_optimiser_of_torch_is_continued():
    """Five steps of torch's Adam and five of ours are ten of torch's, at another rate from then on."""
    torch.manual_seed(0)
    theirs, ours = nn.Parameter(torch.randn(4)), nn.Linear(4, 1, bias=False)
    adam = torch.optim.Adam([theirs], eps=1e-5)
    optimiser = clipped_adam.ClippedAdam(ours)
    optimiser.load_state_dict(adam.state_dict())  # nothing yet
    gradients = torch.randn(10, 4)
    for gradient in gradients[:5]:
        theirs.grad = gradient
        adam.step()
    with torch.no_grad():
        ours.weight.copy_(theirs[None])
    optimiser.load_state_dict(adam.state_dict())
    optimiser.rate = adam.param_groups[0]["lr"] = 0.1
    for gradient in gradients[5:]:
        theirs.grad, ours.weight.grad = gradient, gradient[None].clone()
        adam.step()
        optimiser.step(max_norm=torch.inf)
    torch.testing.assert_close(ours.weight[0], theirs)


def test_a_last_batch_of_one_sample_is_learnt_from():
    """Five samples in batches of four: the one that is left over has no spread to be scaled by."""
    torch.manual_seed(0)
    actor_critic = agent.Agent(3, 2, config.PpoNetworks(hidden=(8,)), None)
    played = Rollout(5, 1, 3, 2)
    played.observation.normal_()
    played.action.normal_()
    with torch.no_grad():
        played.log_density[:] = actor_critic.log_density(played.observation, played.action)
    optimiser = clipped_adam.ClippedAdam(actor_critic)
    before = [parameter.detach().clone() for parameter in actor_critic.parameters()]
    settings = config.Ppo(batch_size=4, n_epochs=2)
    ppo.update(actor_critic, optimiser, played, (torch.randn(5), torch.randn(5)), settings, np.random.default_rng(0))
    assert all(torch.isfinite(parameter).all() for parameter in actor_critic.parameters())
    assert not any(torch.equal(*pair) for pair in zip(before, actor_critic.parameters(), strict=True))


def test_density_is_that_of_the_normal_law():
    actor_critic = agent.Agent(3, 2, config.PpoNetworks(hidden=(8,), log_std=-0.3), None)
    observation, action = torch.randn(4, 3), torch.randn(4, 2)
    law = torch.distributions.Normal(actor_critic.actor(observation), actor_critic.log_std.exp())
    torch.testing.assert_close(actor_critic.log_density(observation, action), law.log_prob(action).sum(-1))
    torch.testing.assert_close(actor_critic.entropy(), law.entropy()[0].sum())
    deviation = torch.randn(4, 2)
    drawn = actor_critic.act(observation, deviation)
    torch.testing.assert_close(actor_critic.log_density_of(deviation), actor_critic.log_density(observation, drawn))


def test_it_learns_to_go_faster_on_open_ground(tmp_path):
    """Ground that is slippery lengthways rewards a quicker wave: 40,000 steps double the untrained distance.

    On 20 fields for choosing, for 8 s; untrained action zero is the thesis's gait.
    """
    settings = config.PpoConfig(
        env_id="SnakeFree-v1",
        env={"max_episode_steps": 160, "reward_weights": {"progress": 10.0, "energy": 0.01, "smoothness": 0.01}},
        num_envs=32,
        num_threads=1,
        total_steps=40_960,
        ppo=config.Ppo(n_steps=32, batch_size=256, learning_rate=1e-3),
        policy=config.PpoNetworks(hidden=(32,), log_std=-0.7),
    )
    run = folder(tmp_path / "run")
    run.create(settings)
    assert ppo.train(run, settings, show=False) == 0
    learnt = rollout.run_episodes(Network(run.policy), "SnakeFree-v1", seeds.selection(20), 1, max_episode_steps=160)
    gait = GaitPolicy(GaitParameters())
    still = rollout.run_episodes(gait, "SnakeFree-v1", seeds.selection(20), 1, max_episode_steps=160)
    assert learnt["speed"].mean() > 2.0 * still["speed"].mean() > 0.0


def test_it_needs_no_other_learner_and_no_pictures(tmp_path):
    """Nor torch's compiler: one learns and goes on from a checkpoint where none of these can be imported."""
    missing = ("stable_baselines3", "matplotlib", "optuna", "scipy", "torch._dynamo")
    code = (
        f"import sys, pathlib; sys.modules.update(dict.fromkeys({missing}));"
        "import training.policies, snake_env.evaluation.rollout; from training import config;"
        "from training.learners.ppo import Learner;"
        "config.load('field-hard');"
        "learner = Learner(config.load('smoke', 'ppo'), 0, print); learner.collect(); learner.learn(0.0);"
        f"path = pathlib.Path({str(tmp_path / 'kept')!r});"
        "learner.save(path, {}); learner.restore(path); learner.close()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
