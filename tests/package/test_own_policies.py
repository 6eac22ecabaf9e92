"""Policies that users bring: models of Stable-Baselines3, ONNX files, modules of torch, functions, names."""

from __future__ import annotations

import base64
import json
import pickle
import zipfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("scipy")
pytest.importorskip("onnxruntime")

import cloudpickle
import stable_baselines3 as algorithms
import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecNormalize

import snake_env
from snake_env import ConfigError
from snake_env.__main__ import main
from snake_env.evaluation import scores
from snake_env.evaluation.tasks import acting_in
from snake_env.policies import NAMES, load_policy
from snake_env.policies.foreign import Function, Model
from snake_env.policies.network import Network
from snake_env.policies.onnx_file import OnnxPolicy, export

SIZES = {"n_steps": 8, "batch_size": 16}
OFF_POLICY = {"buffer_size": 100}
KINDS = {
    "PPO": ("PPO", SIZES),
    "PPO without layers": ("PPO", SIZES | {"policy_kwargs": {"net_arch": []}}),
    "PPO of relu": ("PPO", SIZES | {"policy_kwargs": {"activation_fn": torch.nn.ReLU}}),
    "PPO of leaky relu": ("PPO", SIZES | {"policy_kwargs": {"activation_fn": torch.nn.LeakyReLU, "net_arch": [9]}}),
    "PPO with gSDE": ("PPO", SIZES | {"use_sde": True, "policy_kwargs": {"squash_output": True}}),
    "A2C of elu": ("A2C", {"policy_kwargs": {"activation_fn": torch.nn.ELU}}),
    "SAC": ("SAC", OFF_POLICY),
    "SAC of silu": ("SAC", OFF_POLICY | {"policy_kwargs": {"activation_fn": torch.nn.SiLU, "net_arch": [8, 8]}}),
    "TD3": ("TD3", OFF_POLICY),
}


def venv(**options):
    return snake_env.sb3.make("SnakeField-v1", 2, seed=0, **options)


def normalised(env):
    """Observations are scaled by the statistics of some steps."""
    scaled = VecNormalize(env, clip_obs=2.0)
    scaled.reset()
    for _ in range(20):
        scaled.step(np.random.default_rng(0).uniform(-1.0, 1.0, (2, 4)).astype(np.float32))
    return scaled


@pytest.mark.parametrize("kind", KINDS)
def test_a_zip_acts_as_its_model_without_running_its_code(tmp_path, kind, monkeypatch):
    algorithm, settings = KINDS[kind]
    env = normalised(venv())
    model = getattr(algorithms, algorithm)("MlpPolicy", env, device="cpu", seed=1, **settings)
    model.save(tmp_path / "model.zip")
    env.save(tmp_path / "vecnormalize.pkl")
    monkeypatch.setattr(cloudpickle, "loads", lambda *_: pytest.fail("a pickle was loaded"))
    monkeypatch.setattr(pickle, "load", lambda *_: pytest.fail("a pickle was loaded"))
    policy = load_policy(tmp_path / "model.zip")
    assert isinstance(policy, Network)
    assert "normalised by vecnormalize.pkl" in policy.card.about
    observation = 3.0 * np.random.default_rng(2).standard_normal((7, 63)).astype(np.float32)
    expected = model.predict(env.normalize_obs(observation), deterministic=True)[0]
    np.testing.assert_allclose(np.clip(policy(observation), -1.0, 1.0), expected, atol=2e-5)
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_array_equal(load_policy(model)(observation), expected)
    plain = load_policy(tmp_path / "model.zip", normalize=False)
    np.testing.assert_allclose(
        np.clip(plain(observation), -1.0, 1.0), model.predict(observation, deterministic=True)[0], atol=2e-5
    )
    exported = tmp_path / "model.onnx"
    export(policy, exported)
    np.testing.assert_allclose(load_policy(exported)(observation), policy(observation), atol=2e-5)


@pytest.mark.parametrize(
    ("model", "statistics", "found"),
    [
        ("model.zip", "model_vecnormalize.pkl", True),
        ("rl_model_1000_steps.zip", "rl_model_vecnormalize_1000_steps.pkl", True),
        ("rl_model_1000_steps.zip", "rl_model_vecnormalize_2000_steps.pkl", False),
    ],
)
def test_statistics_are_found_under_the_names_of_callbacks(tmp_path, model, statistics, found):
    env = normalised(venv())
    algorithms.PPO("MlpPolicy", env, **SIZES).save(tmp_path / model)
    env.save(tmp_path / statistics)
    assert (load_policy(tmp_path / model).scaling is not None) == found
    assert load_policy(tmp_path / model, normalize=tmp_path / statistics).scaling is not None


class Halved(BaseFeaturesExtractor):
    """Features of the user's own."""

    def __init__(self, space):
        super().__init__(space, 63)

    def forward(self, observation):
        return 0.5 * observation


class OwnPolicy(ActorCriticPolicy):
    """A policy of the user's own."""


@pytest.mark.parametrize("own", [OwnPolicy, "features"])
def test_a_zip_with_code_of_its_own_is_read_when_it_is_trusted(tmp_path, own):
    kind, settings = ("MlpPolicy", {"features_extractor_class": Halved}) if own == "features" else (own, {})
    model = algorithms.PPO(kind, venv(), device="cpu", policy_kwargs=settings, **SIZES)
    model.save(tmp_path / "model.zip")
    with pytest.raises(ConfigError, match=r"any code: .* trust=True, or --trust .*of its own"):
        load_policy(tmp_path / "model.zip")
    policy = load_policy(tmp_path / "model.zip", trust=True)
    assert isinstance(policy, Model)
    observation = np.random.default_rng(2).standard_normal((3, 63)).astype(np.float32)
    np.testing.assert_array_equal(policy(observation), model.predict(observation, deterministic=True)[0])


class Trap:
    """Leaves a file where it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def test_pickles_in_files_run_nothing(tmp_path):
    model, ran = tmp_path / "model.zip", tmp_path / "ran"
    env = normalised(venv())
    algorithms.PPO("MlpPolicy", env, **SIZES).save(model)
    env.save(tmp_path / "vecnormalize.pkl")
    with zipfile.ZipFile(model) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    hostile = pickle.dumps(Trap(ran))
    (tmp_path / "vecnormalize.pkl").write_bytes(hostile)
    with pytest.raises(ConfigError, match=r"expected a file that VecNormalize\.save has written"):
        load_policy(model)
    (tmp_path / "vecnormalize.pkl").unlink()
    for part in ("policy.pth", "data"):
        if part == "data":
            text = json.loads(content["data"])
            text["policy_class"][":serialized:"] = base64.b64encode(hostile).decode()
            changed = json.dumps(text).encode()
        else:
            changed = hostile
        with zipfile.ZipFile(model, "w") as archive:
            for name, whole in content.items():
                archive.writestr(name, changed if name == part else whole)
        if part == "data":
            load_policy(model)
        else:
            with pytest.raises(ConfigError, match="policy = "):
                load_policy(model)
    torch.save(Trap(ran), tmp_path / "module.pt")
    with pytest.raises(ConfigError, match="trust=True"):
        load_policy(tmp_path / "module.pt")
    assert not ran.exists()
    pickle.loads(hostile)
    assert ran.exists(), "the trap works"


def test_modules_of_torch_act_when_they_are_trusted(tmp_path):
    module = torch.nn.Sequential(torch.nn.Linear(63, 4), torch.nn.Tanh())
    observation = np.random.default_rng(2).standard_normal((3, 63)).astype(np.float32)
    expected = module(torch.from_numpy(observation)).detach().numpy()
    torch.save(module, tmp_path / "module.pt")
    for policy in (load_policy(module), load_policy(tmp_path / "module.pt", trust=True)):
        assert isinstance(policy, Function)
        np.testing.assert_allclose(policy(observation), expected, atol=1e-6)
    torch.save(module.state_dict(), tmp_path / "weights.pt")
    with pytest.raises(ConfigError, match="not only its weights"):
        load_policy(tmp_path / "weights.pt", trust=True)


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_policy_acts_alike_as_an_onnx_file(tmp_path, name):
    policy = load_policy(name)
    export(policy, tmp_path / f"{name}.onnx")
    other = load_policy(tmp_path / f"{name}.onnx")
    assert isinstance(other, OnnxPolicy)
    assert (other.name, other.card.env_id, other.env_options) == (name, policy.card.env_id, policy.env_options)
    envs = policy.make_vec(3)
    observation, _ = envs.reset(seed=0)
    for one in (policy, other):
        one.begin(envs.unwrapped.layout, 3)
    for k in range(30):
        action = policy(observation)
        np.testing.assert_allclose(other(observation), action, atol=2e-5)
        observation, *_ = envs.step(action)
        if k == 15:
            for one in (policy, other):
                one.reset(np.array([True, False, True]))
    envs.close()


def test_an_onnx_file_for_one_robot_acts_for_all(tmp_path):
    onnx = pytest.importorskip("onnx")
    path = tmp_path / "isotropic.onnx"
    export(load_policy("isotropic"), path)
    model = onnx.load(path)
    model.graph.input[0].type.tensor_type.shape.dim[0].dim_value = 1
    onnx.save(model, tmp_path / "one.onnx")
    sees = model.graph.input[0].type.tensor_type.shape.dim[1].dim_value
    observation = np.random.default_rng(0).standard_normal((5, sees)).astype(np.float32)
    np.testing.assert_allclose(
        load_policy(tmp_path / "one.onnx")(observation), load_policy(path)(observation), atol=1e-6
    )
    with pytest.raises(ConfigError, match=r"^normalize = .*: it is of zips"):
        load_policy(path, normalize="vecnormalize.pkl")


def gait(observation):
    """Action zero."""
    return np.zeros((len(observation), 4), np.float32)


class Remembering(snake_env.policies.Policy):
    """Counts the steps of each robot."""

    name = "remembering"
    env_options = {"action_mode": "gait"}  # noqa: RUF012

    def begin(self, layout, num_envs):
        self.steps = np.zeros(num_envs)

    def reset(self, rows):
        self.steps[rows] = 0.0

    def __call__(self, observation):
        self.steps += 1.0
        return gait(observation)


def test_functions_and_classes_are_imported_by_name(tmp_path, monkeypatch):
    (tmp_path / "bring_your_own.py").write_text(Path(__file__).read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load_policy("bring_your_own:gait").name == "gait"
    assert load_policy("bring_your_own:Remembering") is not load_policy("bring_your_own:Remembering")
    for wrong in ("bring_your_own:nix", "no_such_module:act"):
        with pytest.raises(ConfigError, match="module:name that Python can import"):
            load_policy(wrong)


@pytest.mark.parametrize("name", ["heading-control", "heading control", "best-gait", "follow-the-leader"])
def test_scripted_controllers_have_names_with_hyphens(name):
    policy = load_policy(name)
    assert policy.name == name.replace("-", " ")
    envs = policy.make_vec(2)
    observation, _ = envs.reset(seed=0)
    assert policy(observation).shape == envs.action_space.shape
    envs.close()
    with pytest.raises(ConfigError, match="heading-control"):
        load_policy("headingcontrol")


def test_a_model_is_scored_where_it_was_trained(tmp_path):
    env = normalised(venv(perception="blind", max_episode_steps=5))
    model = algorithms.PPO("MlpPolicy", env, device="cpu", **SIZES)
    for weights in model.policy.parameters():
        weights.data.zero_()  # else actions in single precision depend on the size of the batch
    found = snake_env.evaluate(model, episodes=3, seed=4)
    assert (found.task.env_id, found.task.options["max_episode_steps"]) == ("SnakeField-v1", 5)
    in_another = snake_env.evaluate(model, "field-hard", episodes=1)
    assert in_another.task.name == "field-hard"
    given = snake_env.evaluate(
        lambda observation: model.predict(env.normalize_obs(observation))[0] * 0.0,
        env,
        episodes=1,
        normalize=False,
    )
    assert given.task.options["perception"] == "blind"
    alone = snake_env.evaluate(model, episodes=1, seed=6)
    assert len(set(found.episodes["distance"])) == 3
    assert alone.episodes["distance"][0] == found.episodes["distance"][2], "on scene seed + k"
    with pytest.raises(ConfigError, match=r"options\.perception = pegs: expected blind, which PPO acts with"):
        snake_env.evaluate(model, gym.make("SnakeField-v1", perception="pegs"), episodes=1)


def test_a_policy_of_another_size_is_refused(tmp_path):
    algorithms.PPO("MlpPolicy", venv(perception="blind"), device="cpu", **SIZES).save(tmp_path / "mine.zip")
    with pytest.raises(ConfigError, match=r"policy = mine: expected a policy with 63 inputs.* perception"):
        snake_env.evaluate(tmp_path / "mine.zip", "field-hard", episodes=1)


def test_a_model_is_filmed_and_watched(tmp_path):
    pytest.importorskip("imageio")
    pytest.importorskip("viser")
    env = venv(max_episode_steps=5)
    model = algorithms.PPO("MlpPolicy", env, device="cpu", **SIZES)
    film = snake_env.film(model, env, tmp_path / "films/run.gif", seed=2)
    assert film.read_bytes().startswith(b"GIF")
    page = snake_env.view(model, env, port=0)
    try:
        page.playing.value = False
        assert page.policy.value == "PPO"
        page.advance(3)
        assert page.state.time > 0.0
        assert isinstance(page._actor, Model)
    finally:
        page.stop()


def test_a_trained_model_goes_on_into_the_other_commands(tmp_path, capsys):
    out = tmp_path / "mine.zip"
    options = ["--options", '{"max_episode_steps": 5}']
    assert main(["train", "--task", "maze", "--steps", "64", "--num-envs", "1", "--out", str(out), *options]) == 0
    assert f"snake-env view --policy {out}" in capsys.readouterr().out
    latex = tmp_path / "scores.tex"
    named = ["--policy", str(out), "--policy", "heading-control", "--out", str(latex)]
    assert main(["evaluate", "--episodes", "2", *named]) == 0
    about, scenes = capsys.readouterr().out.splitlines()[:2]
    assert about == "mine: Network of Stable-Baselines3."
    assert scenes == 'SnakeMaze-v1 {"difficulty": 1.0, "max_episode_steps": 5}, 2 test scenes'
    assert r" & mine & heading control \\" in latex.read_text()
    onnx = tmp_path / "mine.onnx"
    assert main(["export", str(out), str(onnx)]) == 0
    assert main(["evaluate", "--episodes", "1", "--task", "maze", "--policy", str(onnx), *options]) == 0
    assert main(["export", "heading-control", str(onnx)]) == 2
    assert "a network of linear layers" in capsys.readouterr().err
    assert main(["card", "math:sin"]) == 2
    assert "one that has a card" in capsys.readouterr().err


def test_scores_as_tables():
    task = snake_env.evaluation.BenchmarkTask("open", "SnakeFree-v1", {"max_episode_steps": 5})
    found = [snake_env.evaluate(gait, task, episodes=2, name=name) for name in ("a_b", "another with a long name")]
    table = scores.table({one.name: one.scores for one in found})
    assert max(map(len, table.splitlines())) <= 100
    assert all(one.name in table for one in scores.SCORES)
    latex = found[0].to_latex(found[1])
    assert latex.count(r"\\") == len(scores.SCORES) + 1
    assert r" & a\_b & another with a long name \\" in latex
    assert pytest.importorskip("pandas") is not None
    assert list(found[0].to_dataframe()["time"]) == list(found[0].episodes["time"])


def test_who_acts_keeps_the_task_of_a_benchmark():
    policy, task = acting_in("heading-control", "maze")
    assert (task.name, task.env_id) == ("maze", "SnakeMaze-v1")
    with pytest.raises(ConfigError, match="one tuned for maze"):
        acting_in("follow-the-leader", "maze")
    assert acting_in("follow-the-leader", "SnakeMaze-v1")[0].name == "follow the leader"
    assert policy.name == "heading control"
