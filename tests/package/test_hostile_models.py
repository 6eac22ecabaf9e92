"""Model files from others: zips of Stable-Baselines3, pickles, ONNX files and runs that are broken or too large."""

from __future__ import annotations

import io
import pickle
import zipfile

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import snake_env
from snake_env import ConfigError
from snake_env.policies import load_policy, sb3_zip


class Tanh(torch.nn.Hardtanh):
    """Another activation of this name."""


@pytest.fixture
def model(tmp_path):
    def save(**settings):
        env = snake_env.sb3.make("SnakeField-v1", 2, seed=0)
        made = PPO("MlpPolicy", env, device="cpu", n_steps=8, batch_size=16, policy_kwargs=settings)
        made.save(tmp_path / "model.zip")
        return tmp_path / "model.zip", made

    return save


def rewrite(path, compression=zipfile.ZIP_STORED, **parts):
    """Other contents of parts of a zip."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, whole in content.items():
            archive.writestr(name, parts.get(name.partition(".")[0], whole))


@pytest.mark.parametrize("protocol", [4, 5])
def test_statistics_are_read_in_every_protocol(tmp_path, protocol):
    env = VecNormalize(snake_env.sb3.make("SnakeField-v1", 2, seed=0))
    env.reset()
    path = tmp_path / "vecnormalize.pkl"
    path.write_bytes(pickle.dumps(env, protocol))
    found = sb3_zip.normalization(path)
    np.testing.assert_array_equal(found["normalize.mean"], env.obs_rms.mean)
    np.testing.assert_array_equal(found["normalize.deviation"], np.sqrt(env.obs_rms.var + env.epsilon))


def test_weights_are_not_read_by_a_torch_that_may_run_them(model, monkeypatch):
    path, _ = model()
    monkeypatch.setattr(torch, "__version__", "2.5.1+cpu")
    monkeypatch.setattr(torch, "load", lambda *_, **__: pytest.fail("it was read"))
    with pytest.raises(ConfigError, match=r"torch\.__version__ = 2\.5\.1\+cpu: expected 2\.6 or newer"):
        load_policy(path)


def test_a_small_file_of_large_tensors_is_refused(model):
    path, made = model()
    state = made.policy.state_dict()
    state["mlp_extractor.policy_net.0.weight"] = torch.zeros(1).expand(2**20, 2**13)
    content = io.BytesIO()
    torch.save(state, content)
    rewrite(path, policy=content.getvalue())
    with pytest.raises(ConfigError, match=r"8,589,\d+,\d+ weights, 16,777,216 are the most"):
        load_policy(path)


def test_weights_that_were_compressed_within_are_bounded(model, monkeypatch):
    path, made = model()
    content = io.BytesIO()
    torch.save(made.policy.state_dict(), content)
    inner = path.with_name("policy.pth")
    inner.write_bytes(content.getvalue())
    with zipfile.ZipFile(inner, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("archive/data/large", bytes(2**26 + 1))
    rewrite(path, policy=inner.read_bytes())
    monkeypatch.setattr(torch, "load", lambda *_, **__: pytest.fail("it was read"))
    with pytest.raises(ConfigError, match="archive/data/large has 67,108,865 bytes"):
        load_policy(path)


@pytest.mark.parametrize("error", [MemoryError, OverflowError, NotImplementedError, EOFError])
def test_errors_of_readers_are_errors_of_files(model, monkeypatch, error):
    path, _ = model()

    def fails(*_, **__):
        raise error("reason")

    monkeypatch.setattr(torch, "load", fails)
    with pytest.raises(ConfigError, match=f"a file that can be read .{error.__name__}: reason"):
        load_policy(path)


def test_mutilated_zips_are_refused_or_read(model):
    path, _ = model(net_arch=[2])
    rewrite(path, zipfile.ZIP_DEFLATED)
    whole, draw = path.read_bytes(), np.random.default_rng(1)
    errors = set()
    for _ in range(200):
        content = bytearray(whole)
        for place in draw.integers(0, len(content), 3):
            content[place] = draw.integers(0, 256)
        path.write_bytes(content)
        try:
            load_policy(path)
        except ConfigError as error:
            errors.add(str(error).rpartition("(")[2].partition(":")[0])
    assert "error" in errors, "of zlib"


@pytest.mark.parametrize("kind", [Tanh, torch.nn.GELU])
def test_other_activations_are_of_other_networks(model, kind):
    path, made = model(activation_fn=kind)
    with pytest.raises(ConfigError, match=f"trust=True.*the activation <class '.*{kind.__name__}'> of its own"):
        load_policy(path)
    seen = 3.0 * np.random.default_rng(2).standard_normal((5, 63)).astype(np.float32)
    np.testing.assert_array_equal(load_policy(path, trust=True)(seen), made.predict(seen, deterministic=True)[0])


def onnx_file(path, **changes):
    """A file that remembers, with other inputs: element type and shape by name."""
    onnx = pytest.importorskip("onnx")
    tensor, kinds = onnx.helper.make_tensor_value_info, onnx.TensorProto
    inputs = {name: (kinds.FLOAT, ["n", 4]) for name in ("observation", "state")}
    inputs["begins"] = (kinds.BOOL, ["n", 1])
    names = {"action": "observation", "next_state": "state"}
    inputs |= changes.pop("inputs", {})
    if changes.pop("alone", False):
        inputs, names = {"observation": inputs["observation"]}, {"action": "observation"}
    names = {name: of for name, of in names.items() if name != changes.get("without")}
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node("Identity", [of], [name]) for name, of in names.items()],
        "graph",
        [tensor(name, *one) for name, one in inputs.items()],
        [tensor(name, *inputs[of]) for name, of in names.items()],
    )
    onnx.save(onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=9), path)
    return path


FLOAT, DOUBLE = 1, 11


def test_onnx_files_that_fit_are_read(tmp_path):
    pytest.importorskip("onnxruntime")
    for changes in ({}, {"alone": True}, {"alone": True, "inputs": {"observation": (FLOAT, [1, 4])}}):
        assert load_policy(onnx_file(tmp_path / "p.onnx", **changes))(np.ones((3, 4), np.float32)).shape == (3, 4)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"alone": True, "inputs": {"observation": (DOUBLE, ["n", 4])}}, r"observation is tensor\(double\)"),
        ({"alone": True, "inputs": {"observation": (FLOAT, ["n", 4, 4])}}, "observation is .* of shape"),
        ({"alone": True, "inputs": {"observation": (FLOAT, [4])}}, "observation is .* of shape"),
        ({"alone": True, "inputs": {"observation": (FLOAT, [8, 4])}}, r"of shape \[8, 4\], expected"),
        ({"inputs": {"observation": (FLOAT, [1, 4])}}, r"of shape \[1, 4\], expected"),
        ({"inputs": {"state": (FLOAT, [2, 4])}}, r"state is .* of shape \[2, 4\]"),
        ({"inputs": {"state": (FLOAT, ["n", "k"])}}, "state has the shape .*a number of columns"),
        ({"inputs": {"begins": (FLOAT, ["n", 1])}}, r"begins is tensor\(float\)"),
        ({"without": "next_state"}, "outputs action, expected action and next_state"),
    ],
)
def test_onnx_files_that_do_not_fit_are_refused(tmp_path, changes, words):
    pytest.importorskip("onnxruntime")
    with pytest.raises(ConfigError, match=words):
        load_policy(onnx_file(tmp_path / "p.onnx", **changes))


def test_mutilated_runs_are_refused_or_read(tmp_path):
    path = tmp_path / "run.npz"
    snake_env.simulate(duration=0.1).save(path)
    whole, draw = path.read_bytes(), np.random.default_rng(1)
    damaged = [b"", whole[:100]]
    for _ in range(100):
        content = bytearray(whole)
        for place in draw.integers(0, len(content), 3):
            content[place] = draw.integers(0, 256)
        damaged.append(bytes(content))
    refused = 0
    for content in damaged:
        path.write_bytes(content)
        try:
            snake_env.load_trajectory(path)
        except ConfigError:
            refused += 1
    assert refused > 50
