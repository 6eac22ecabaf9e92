"""Files from others: they run no code, are read within bounds, and are refused in a few words."""

from __future__ import annotations

import json
import struct
import sys
from contextlib import suppress

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Scene
from snake_env import _documents as documents
from snake_env.policies import files

NETWORK = {"actor.0.weight": np.zeros((2, 4)), "actor.0.bias": np.zeros(2)}
DEEP = "[" * 100_000 + "]" * 100_000


def policy_file(path, config):
    """A network with this configuration, or with this text in the place of one."""
    files.write(path, NETWORK, {})
    if config != {}:
        header, data = parts(path)
        header["__metadata__"]["config"] = config if isinstance(config, str) else json.dumps(config)
        join(path, header, data)
    return path


def parts(path):
    """Header and tensors of a safetensors file."""
    content = path.read_bytes()
    size = struct.unpack("<Q", content[:8])[0]
    return json.loads(content[8 : 8 + size]), content[8 + size :]


def join(path, header, data):
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)


def refused(call, match=None):
    """Calls what has to be refused; returns the message."""
    with pytest.raises(ConfigError, match=match) as caught:
        call()
    message = str(caught.value)
    assert len(message.encode()) <= 1000
    return message


@pytest.fixture
def trap(tmp_path, monkeypatch):
    """A module that notes when it is imported, and registers an environment."""
    code = "import gymnasium, pathlib\npathlib.Path(__file__).with_name('ran').touch()\n"
    code += "gymnasium.register('Trap-v0', entry_point='snake_env.env:SnakeEnv')\n"
    (tmp_path / "trap_of_a_file.py").write_text(code)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path / "ran"
    sys.modules.pop("trap_of_a_file", None)


FOREIGN = ["trap_of_a_file:Trap-v0", "trap_of_a_file:SnakeField-v1", "CartPole-v1", "no-such-id", "snake_env:X-v1", ""]


@pytest.mark.parametrize("env_id", FOREIGN)
def test_a_policy_file_names_only_environments_of_this_package(tmp_path, trap, env_id):
    config = {"env_id": env_id, "env": {}, "policy": {"memory": [1.0]}}
    policy = snake_env.load_policy(policy_file(tmp_path / "p.safetensors", config))
    expected = "env_id = .*: expected an id of one of this package's environments"
    refused(policy.make_vec, expected)
    refused(lambda: policy(np.zeros((1, 4), np.float32)), expected)
    assert not trap.exists()


@pytest.mark.parametrize("env_id", FOREIGN[:3])
def test_the_command_that_evaluates_a_policy_runs_no_code_of_its_file(tmp_path, trap, env_id, capsys):
    pytest.importorskip("torch")
    from training import evaluate

    path = policy_file(tmp_path / "p.safetensors", {"env_id": env_id, "env": {}})
    assert evaluate.main(["--policy", str(path), "--fields", "1", "--out", str(tmp_path)]) == 2
    assert "expected an id of one of this package's environments" in capsys.readouterr().err
    assert evaluate.main(["--policy", str(path), "--env", "SnakeFree-v1", "--fields", "1", "--out", str(tmp_path)]) == 2
    assert "a policy with " in capsys.readouterr().err, "of another environment, in which it does not fit"
    assert not trap.exists()


@pytest.mark.parametrize("name", ["num_envs", "vectorization_mode", "wrappers", "render_mode", "reward_fn", "id"])
def test_a_policy_file_chooses_its_task_and_nothing_else(tmp_path, name):
    config = {"env_id": "SnakeField-v1", "env": {name: 3}}
    policy = snake_env.load_policy(policy_file(tmp_path / "p.safetensors", config))
    refused(policy.make_vec, rf"env\.{name} = 3: expected a keyword of a task")


@pytest.mark.parametrize(
    "config",
    [
        "{",
        "[]",
        "3",
        DEEP,
        '{"env": ' + DEEP + "}",
        '{"steps": 1, "steps": 2}',
        '{"steps": ' + "1" * 5000 + "}",
        {"env": []},
        {"env": None},
        {"env_id": 3},
        {"env_id": ["SnakeField-v1"]},
        {"steps": "many"},
        {"about": 5},
        {"policy": 3},
        {"policy": {"memory": 3}},
        {"policy": {"memory": "12"}},
        {"policy": {"memory": [0.0]}},
        {"policy": {"memory": [float("nan")]}},
        {"policy": {"memory": [1.0] * 17}},
        {"about": ["x" * 100_000]},
    ],
)
def test_a_configuration_of_the_wrong_kind_is_refused(tmp_path, config):
    path = policy_file(tmp_path / "p.safetensors", config)
    refused(lambda: snake_env.load_policy(path))


@pytest.mark.parametrize(
    "card",
    [
        "{",
        "[]",
        DEEP,
        {"unknown": 1},
        {"name": "another"},
        {"about": 3},
        {"env_id": {}},
        {"env_options": []},
        {"scored_in": "x"},
        {"scores": [1, 2]},
        {"scores": {"speed": 3}},
        {"scores": {"speed": [1, 2]}},
        {"scores": {"speed": [1, 2, "3"]}},
        {"scores": {"speed": [1, 2, float("inf")]}},
        {"scenes": "many"},
        {"versions": []},
        {"notes": "text"},
        {"notes": [3]},
        {"license": None},
    ],
)
def test_a_card_of_the_wrong_kind_is_refused(tmp_path, card):
    path = policy_file(tmp_path / "p.safetensors", {})
    (tmp_path / "p.json").write_text(card if isinstance(card, str) else json.dumps(card))
    refused(lambda: snake_env.load_policy(path), "^card")


@pytest.mark.parametrize("kind", ["BF16", "F16", "F8_E4M3", "F8_E5M2", "F64", "I32", "BOOL", "nonsense"])
def test_tensors_of_another_type_are_refused_by_name(tmp_path, kind):
    path = policy_file(tmp_path / "p.safetensors", {})
    size = {"BF16": 2, "F16": 2, "F64": 8, "I32": 4}.get(kind, 1)
    header = {"actor.0.weight": {"dtype": kind, "shape": [2, 4], "data_offsets": [0, 8 * size]}}
    join(path, header, bytes(8 * size))
    refused(lambda: snake_env.load_policy(path), "safetensors" if kind == "nonsense" else f"is {kind}, expected F32")


def test_networks_without_inputs_or_outputs_are_refused(tmp_path):
    path = tmp_path / "p.safetensors"
    for shape in ((0, 4), (2, 0)):
        files.write(path, {"actor.0.weight": np.zeros(shape), "actor.0.bias": np.zeros(shape[0])}, {})
        refused(lambda: snake_env.load_policy(path), r"actor\.0\.weight has the shape")


def test_mutilated_policies_are_refused_or_read(tmp_path):
    path = policy_file(tmp_path / "p.safetensors", {"env_id": "SnakeField-v1", "env": {}})
    whole, draw = bytearray(path.read_bytes()), np.random.default_rng(1)
    for _ in range(300):
        content = whole.copy()
        for place in draw.integers(0, len(content), 3):
            content[place] = draw.integers(0, 256)
        path.write_bytes(content[: draw.integers(0, len(content) + 1)] if draw.random() < 0.3 else content)
        with suppress(ConfigError):
            snake_env.load_policy(path)


@pytest.mark.parametrize("name", ["p.safetensors", "s.json", "s.yaml"])
def test_files_are_not_read_when_they_are_too_large(tmp_path, name, monkeypatch):
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(documents.LARGEST + 1)
    monkeypatch.setattr(documents.json, "loads", lambda *_, **__: pytest.fail("it was read"))
    load = snake_env.load_policy if path.suffix == ".safetensors" else Scene.load
    refused(lambda: load(path), "67,108,864 are the most")


@pytest.mark.parametrize("load", [snake_env.load_policy, Scene.load])
def test_names_that_no_file_can_have_are_refused(load):
    for name in ("x" * 10_000, "nul\0", "/dev/zero"):
        refused(lambda name=name: load(name))


SCENE = '"format": "snake_env scene 1"'


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("s.json", f'{{{SCENE}, "obstacles": [], "obstacles": []}}', "obstacles is there twice"),
        ("s.json", f'{{{SCENE}, "obstacles": [{{"radius": 1, "radius": 2}}]}}', "radius is there twice"),
        ("s.yaml", f"{SCENE}\nfriction: [0.1, 0.1]\nfriction: [0.2, 0.2]", "friction is there twice"),
        ("s.json", f'{{{SCENE}, "obstacles": {DEEP}}}', "nested deeper than 32 levels"),
        ("s.yaml", f"{SCENE}\nobstacles: {DEEP}", "nested deeper than 32 levels"),
        ("s.json", "[" * 40 + "]" * 40, "nested deeper than 32 levels"),
        ("s.yaml", f"{SCENE}\nobstacles: &a [*a]", "an alias, \\*a"),
        ("s.yaml", "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]", "an alias, \\*a"),
        ("s.yaml", "!!python/object/apply:os.system ['true']", "a file in YAML"),
        ("s.yaml", f"{SCENE}\n? [1, 2]\n: 3", "a file in YAML"),
        ("s.json", f'{{{SCENE}, "{"x" * 100_000}": 1}}', None),
        ("s.json", f'{{{SCENE}, "obstacles": "{"x" * 100_000}"}}', None),
        ("s.json", "x" * 100_000, "a file in JSON"),
        ("s.json", "\ud800", "a file in JSON"),
    ],
)
def test_a_scene_file_is_refused_in_a_few_words(tmp_path, name, text, words):
    (tmp_path / name).write_bytes(text.encode(errors="surrogatepass"))
    refused(lambda: Scene.load(tmp_path / name), words)


@pytest.mark.parametrize("value", ["x" * 9999, ["y" * 9999], "\N{SNAKE}" * 9999, {"z" * 9999: 1}, "\ud800" * 999])
def test_messages_do_not_grow_with_what_they_show(value):
    for call in (
        lambda: snake_env.SnakeEnv(task=value),
        lambda: snake_env.SnakeEnv(**{"k" * 10_000: value}),
        lambda: snake_env.simulate(record=value),
        lambda: snake_env.Robot(mass=value),
    ):
        assert ": expected " in refused(call)


def test_what_is_short_is_shown_whole():
    with pytest.raises(ConfigError) as caught:
        snake_env.SnakeEnv(nonsense=5)
    assert str(caught.value) == f"nonsense = 5: expected {caught.value.expected}"
