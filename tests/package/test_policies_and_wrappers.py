"""Models and environments as users make them: wrappers, lengths of episodes, statistics, options."""

from __future__ import annotations

import json

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("scipy")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.torch_layers import FlattenExtractor
from stable_baselines3.common.vec_env import DummyVecEnv, VecFrameStack, VecMonitor, VecNormalize

import snake_env
from snake_env import ConfigError
from snake_env.__main__ import main
from snake_env.evaluation.tasks import BenchmarkTask, acting_in
from snake_env.policies import load_policy
from snake_env.policies.foreign import Model

ID = "SnakeField-v1"
SEEN = 3.0 * np.random.default_rng(2).standard_normal((7, 63)).astype(np.float32)


def act(observation):
    """Action zero."""
    return np.zeros((len(observation), 4), np.float32)


def ppo(env, **settings):
    return PPO("MlpPolicy", env, device="cpu", seed=1, n_steps=8, batch_size=16, **settings)


def venv():
    return snake_env.sb3.make(ID, 2, seed=0, max_episode_steps=5)


def normalised():
    """Observations are scaled by statistics of their own."""
    env = VecNormalize(venv(), clip_obs=2.0)
    env.obs_rms.mean[:], env.obs_rms.var[:] = 0.5, 4.0
    return env


def test_a_model_of_single_environments_is_played_where_it_was_trained():
    model = ppo(gym.make(ID, max_episode_steps=5, perception="blind"))
    policy, task = acting_in(model)
    assert (task.env_id, task.options["max_episode_steps"]) == (ID, 5)
    assert policy.env_options["perception"] == "blind"
    assert snake_env.evaluate(model, episodes=2).episodes["time"].max() == pytest.approx(0.25)


@pytest.mark.parametrize(
    "make",
    [
        lambda: gym.make(ID, max_episode_steps=5),
        lambda: DummyVecEnv([lambda: gym.make(ID, max_episode_steps=5)]),
        lambda: gym.make_vec(ID, num_envs=2, max_episode_steps=5),
        lambda: gym.make_vec(ID, num_envs=2, max_episode_steps=5, vectorization_mode="sync"),
        lambda: VecMonitor(venv()),
        lambda: gym.wrappers.RecordEpisodeStatistics(gym.make(ID, max_episode_steps=5)),
    ],
)
def test_episodes_are_as_long_as_those_of_the_environment(make):
    assert acting_in(act, make())[1] == BenchmarkTask(ID, ID, {"task": "field", "max_episode_steps": 5})


def test_the_registered_length_is_no_keyword():
    assert acting_in(act, gym.make(ID))[1].options == {"task": "field"}


WRAPPERS = {
    "NormalizeObservation": lambda: gym.wrappers.NormalizeObservation(gym.make(ID)),
    "RescaleAction": lambda: gym.wrappers.RescaleAction(gym.make(ID), np.float32(-2.0), np.float32(2.0)),
    "FrameStackObservation": lambda: gym.wrappers.FrameStackObservation(gym.make(ID), 2),
    "TransformAction": lambda: gym.wrappers.TransformAction(gym.make(ID), lambda action: -action, None),
    "VecFrameStack": lambda: VecFrameStack(venv(), 2),
    "TransformObservation": lambda: gym.wrappers.vector.TransformObservation(gym.make_vec(ID, num_envs=2), abs),
}


@pytest.mark.parametrize("name", WRAPPERS)
def test_wrappers_that_change_what_a_policy_sees_or_does_are_named(name):
    with pytest.raises(ConfigError, match=f"env = {name}: expected .*VecNormalize"):
        acting_in(act, WRAPPERS[name]())


@pytest.mark.parametrize("name", ["NormalizeObservation", "RescaleAction", "VecFrameStack"])
def test_they_are_named_in_the_environment_of_a_model(name):
    with pytest.raises(ConfigError, match=f"env = {name}"):
        load_policy(ppo(WRAPPERS[name]()))


def test_the_environment_has_the_statistics_that_a_policy_has_not(tmp_path):
    env, model = normalised(), ppo(venv())
    model.save(tmp_path / "model.zip")
    expected = model.predict(env.normalize_obs(SEEN), deterministic=True)[0]
    for policy in (model, tmp_path / "model.zip"):
        scaled, _ = acting_in(policy, env)
        np.testing.assert_allclose(np.clip(scaled(SEEN), -1.0, 1.0), expected, atol=2e-5)
        plain, _ = acting_in(policy, env, normalize=False)
        assert np.abs(np.clip(plain(SEEN), -1.0, 1.0) - expected).max() > 1e-3
    others = normalised()
    others.obs_rms.mean[:] = -3.0
    own, _ = acting_in(ppo(env), others)
    np.testing.assert_array_equal(own(SEEN), expected)
    assert acting_in("general", env)[0].scaling is None
    with pytest.raises(ConfigError, match="normalize = None: expected False for act"):
        acting_in(act, env)


def test_false_is_no_normalisation_of_a_model_either(tmp_path):
    env = normalised()
    model = ppo(env)
    np.testing.assert_array_equal(load_policy(model, normalize=False)(SEEN), model.predict(SEEN, deterministic=True)[0])
    env.save(tmp_path / "other.pkl")
    np.testing.assert_allclose(
        load_policy(ppo(venv()), normalize=tmp_path / "other.pkl")(SEEN), load_policy(model)(SEEN), atol=2e-6
    )
    with pytest.raises(ConfigError, match=r"^normalize = .*none\.pkl: expected a file that VecNormalize\.save"):
        load_policy(model, normalize=tmp_path / "none.pkl")


class Own(snake_env.policies.Policy):
    """A policy of the user's own."""

    name = "own"
    env_options = {}  # noqa: RUF012
    begin = reset = __call__ = None


@pytest.mark.parametrize("policy", [act, Own(), "gait", "30,120,-50", "heading-control", "general", "math:sin"])
def test_statistics_are_refused_where_nothing_takes_them(policy):
    with pytest.raises(ConfigError, match=r"^normalize = some\.pkl: expected None for "):
        load_policy(policy, normalize="some.pkl")


def test_statistics_belong_to_one_policy_of_a_command(tmp_path, capsys):
    env = normalised()
    ppo(env).save(tmp_path / "model.zip")
    env.save(tmp_path / "statistics.pkl")
    command = ["evaluate", "--episodes", "1", "--normalize", str(tmp_path / "statistics.pkl"), "--policy"]
    options = ["--options", '{"max_episode_steps": 3}']
    assert main([*command, "heading-control", *options]) == 2
    assert "expected None for heading-control" in capsys.readouterr().err
    assert main([*command, str(tmp_path / "model.zip"), *options]) == 0
    with pytest.raises(SystemExit):
        main([*command, str(tmp_path / "model.zip"), "--policy", "gait", *options])
    assert "expected one --policy" in capsys.readouterr().err


@pytest.mark.parametrize("policy", ["general", "file", act])
def test_a_policy_does_not_change_the_task(tmp_path, policy):
    if policy == "file":
        ppo(venv()).save(policy := tmp_path / "model.zip")
    with pytest.raises(ConfigError, match=r"env_options\['difficulty'\] = 0\.1: .*others are the task's"):
        snake_env.evaluate(policy, "field-hard", env_options={"difficulty": 0.1}, episodes=1)


@pytest.mark.parametrize("policy", ["gait", "30,120,-50", "heading-control"])
def test_what_has_options_takes_none(policy):
    with pytest.raises(ConfigError, match=r"env_options = .*: expected observation_blocks only for"):
        load_policy(policy, env_options={"perception": "blind"})


class Features(FlattenExtractor):
    """Features of the user's own."""


def test_a_trusted_zip_has_a_card(tmp_path):
    ppo(venv(), policy_kwargs={"features_extractor_class": Features}).save(tmp_path / "model.zip")
    run = {"env_id": "SnakeMaze-v1", "env": {"action_mode": "gait", "max_episode_steps": 5}}
    (tmp_path / "config.json").write_text(json.dumps(run))
    (tmp_path / "model.json").write_text('{"steps": 64}')
    policy = load_policy(tmp_path / "model.zip", trust=True)
    assert isinstance(policy, Model)
    assert (policy.card.env_id, policy.card.env_options, policy.card.steps) == ("SnakeMaze-v1", run["env"], 64)
    assert policy.env_options == {"action_mode": "gait"}
    assert acting_in(tmp_path / "model.zip", trust=True)[1].env_id == "SnakeMaze-v1"


def test_a_module_acts_without_dropout_and_goes_on_learning():
    module = torch.nn.Sequential(torch.nn.Linear(63, 4), torch.nn.Dropout(0.9), torch.nn.BatchNorm1d(4).eval())
    policy = load_policy(module)
    np.testing.assert_array_equal(policy(SEEN), policy(SEEN))
    assert [part.training for part in module.modules()] == [True, True, True, False]


class Elsewhere(torch.nn.Module):
    """Has its parameters on a device without values."""

    def __init__(self):
        super().__init__()
        self.weight = torch.nn.Parameter(torch.zeros(4, device="meta"))

    def forward(self, observation):
        assert observation.device == self.weight.device
        return torch.zeros(len(observation), 4)


def test_a_module_is_called_on_the_device_of_its_parameters():
    assert load_policy(Elsewhere())(SEEN).shape == (7, 4)


def test_equal_names_do_not_overwrite_each_other(tmp_path, capsys):
    paths = [tmp_path / name / "best_model.zip" for name in ("a", "b")]
    for path in paths:
        path.parent.mkdir()
        ppo(venv()).save(path)
    named = [part for path in paths for part in ("--policy", str(path))]
    out = tmp_path / "scores.json"
    command = ["evaluate", "--episodes", "1", "--options", '{"max_episode_steps": 3}', "--out", str(out)]
    assert main([*command, *named, "--policy", "gait"]) == 0
    assert list(json.loads(out.read_text())["scores"]) == [*map(str, paths), "thesis gait"]
    task = BenchmarkTask("open", "SnakeFree-v1", {"max_episode_steps": 3})
    first, second, third = (snake_env.evaluate(act, task, episodes=1, name=name) for name in ("x", "x", "y"))
    assert r" & x (1) & x (2) & y \\" in first.to_latex(second, third)


def test_a_scripted_controller_refuses_other_observations():
    policy = load_policy("heading-control")
    envs = gym.make_vec(ID, num_envs=2, action_mode="gait", perception="blind")
    observation, _ = envs.reset(seed=0)
    with pytest.raises(ConfigError, match=f"with {observation.shape[1]} inputs"):
        policy(observation)
    policy.begin(envs.unwrapped.layout, 2)
    assert policy(observation).shape == envs.action_space.shape
    envs.close()


@pytest.mark.parametrize(("option", "value"), [("--steps", "0"), ("--num-envs", "0")])
def test_training_of_nothing_is_refused(tmp_path, option, value, capsys):
    assert main(["train", option, value, "--out", str(tmp_path / "model.zip")]) == 2
    assert f"{option[2:].replace('-', '_')} = 0: expected an integer >= 1" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_training_overwrites_its_own_files_only(tmp_path, capsys):
    out, beside = tmp_path / "settings.zip", tmp_path / "settings.json"
    command = ["train", "--env", "SnakeFree-v1", "--steps", "64", "--num-envs", "1", "--out", str(out)]
    for content in ('{"mine": 1}', "[", "3"):
        beside.write_text(content)
        assert main(command) == 2
        assert "a name without another settings.json beside it" in capsys.readouterr().err
        assert beside.read_text() == content
    beside.unlink()
    assert main(command) == main(command) == 0
