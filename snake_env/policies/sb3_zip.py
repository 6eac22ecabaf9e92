"""Policies that Stable-Baselines3 has saved, read without running what their files say.

A zip file of Stable-Baselines3 and the file of a ``VecNormalize`` contain pickles, which can run any code. Here weights
are read by ``torch.load(weights_only=True)``, settings from the zip's JSON, and statistics by an unpickler to which
every class is an empty one.
"""

from __future__ import annotations

import io
import pickle
import re
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env import _documents
from snake_env._extras import extras
from snake_env.errors import ConfigError
from snake_env.policies.network import ACTIVATIONS

Double = NDArray[np.float64]


class _Family(NamedTuple):
    """Algorithms whose actors are alike: patterns of their tensors, with layer and part as groups.

    Attributes:
        hidden: tensors of the layers that are numbered.
        output: those of the last layer, where it has a name of its own.
        others: those that do not act.
        activation: the default one.
        squash: tanh bounds the output.
    """

    hidden: str
    output: str
    others: str
    activation: str
    squash: bool


NUMBERED, PART = r"\.(\d+)\.(weight|bias)", r"\.(weight|bias)"
FAMILIES = (
    _Family(
        f"mlp_extractor.policy_net{NUMBERED}",
        f"action_net{PART}",
        r"(value_net|mlp_extractor\.value_net|log_std)\b.*",
        "Tanh",
        False,
    ),
    _Family(f"actor.latent_pi{NUMBERED}", f"actor.mu{PART}", r"(critic\w*|actor\.log_std)\b.*", "ReLU", True),
    _Family(f"actor.mu{NUMBERED}", "", r"(critic\w*|actor_target)\b.*", "ReLU", True),
)
"""PPO and A2C; SAC and TQC; TD3 and DDPG."""

ACTIVATION = "torch.nn.modules.activation."
SAFE_TORCH = (2, 6)
"""The first version that reads weights without running code (CVE-2025-32434)."""

MOST = _documents.LARGEST // 4
"""Weights of a policy, float32."""


class OtherNetwork(ValueError):
    """Layers are not all that is in a policy."""


def read(path: Path) -> tuple[dict[str, Double], dict[str, Any]]:
    """A network of linear layers as :func:`snake_env.policies.files.read` returns one.

    Raises:
        OtherNetwork: the policy is of another kind.
        ValueError: the file is broken, or too large.
        MissingExtra: torch is missing.
    """
    _documents.require_size(path)
    with zipfile.ZipFile(path) as archive:
        _require_size(archive)
        data = _documents.of_json(archive.read("data").decode())
        weights = io.BytesIO(archive.read("policy.pth"))
    if zipfile.is_zipfile(weights):
        with zipfile.ZipFile(weights) as archive:
            _require_size(archive)
    weights.seek(0)
    with extras():
        import torch
    if tuple(map(int, torch.__version__.split(".")[:2])) < SAFE_TORCH:
        expected = "2.6 or newer, since earlier ones may run code that is in files of weights"
        raise ConfigError("torch.__version__", str(torch.__version__), expected)
    state = torch.load(weights, map_location="cpu", weights_only=True)
    if (numbers := sum(tensor.numel() for tensor in state.values())) > MOST:  # those of a tensor may share storage
        raise ValueError(f"it has {numbers:,} weights, {MOST:,} are the most")
    tensors = {name: np.asarray(tensor, np.float64) for name, tensor in state.items()}
    parts = ("policy_kwargs", "policy_class", "observation_space", "action_space")
    settings, module, seen, done = (_mapping(data, name) for name in parts)
    extractor = str(settings.get("features_extractor_class", "FlattenExtractor'>"))
    _require(str(module.get("__module__")).startswith(("stable_baselines3.", "sb3_contrib.")), "a policy class")
    _require(extractor.endswith("FlattenExtractor'>"), "a features extractor")
    for what, space in (("observations", seen), ("actions", done)):
        _require(space.get(":type:") == "<class 'gymnasium.spaces.box.Box'>", what)
    arrays, family = _actor(tensors)
    squash = family.squash or (data.get("use_sde") is True and str(settings.get("squash_output")) == "True")
    named = str(settings.get("activation_fn", f"<class '{ACTIVATION}{family.activation}'>"))
    kind = named.removeprefix(f"<class '{ACTIVATION}").removesuffix("'>").lower()
    _require(kind in ACTIVATIONS, f"the activation {named}")
    return arrays, {"policy": {"activation": kind, "squash": squash}}


def _require_size(archive: zipfile.ZipFile) -> None:
    for info in archive.infolist():
        if info.file_size > _documents.LARGEST:
            raise ValueError(f"{info.filename} has {info.file_size:,} bytes, {_documents.LARGEST:,} are the most")


def _actor(tensors: dict[str, Double]) -> tuple[dict[str, Double], _Family]:
    """Layers of the actor, and what it is one of."""
    acts = (one for one in FAMILIES if any(re.fullmatch(f"{one.hidden}|{one.output}", name) for name in tensors))
    if (family := next(acts, None)) is None:
        raise OtherNetwork(f"no actor among the tensors {', '.join(tensors)}")
    arrays, outputs = {}, {}
    for name, tensor in tensors.items():
        if (found := re.fullmatch(family.hidden, name)) is not None and int(found[1]) % 2 == 0:
            arrays[f"actor.{int(found[1]) // 2}.{found[2]}"] = tensor
        elif re.fullmatch(family.output, name):
            outputs[name.rpartition(".")[2]] = tensor
        else:
            _require(re.fullmatch(family.others, name) is not None, f"the tensor {name}")
    last = len(arrays) // 2
    return arrays | {f"actor.{last}.{part}": tensor for part, tensor in outputs.items()}, family


def _mapping(data: Any, name: str) -> dict[str, Any]:
    found = data.get(name) if isinstance(data, dict) else None
    return found if isinstance(found, dict) else {}


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise OtherNetwork(f"it has {what} of its own")


class _Inert:
    """Stands for an object of any class: keeps what it was made from and does nothing."""

    def __new__(cls, *args: Any, **_: Any) -> _Inert:
        made = super().__new__(cls)
        made.args, made.state = args, None
        return made

    args: tuple[Any, ...]
    state: Any

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Reader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        return type(name, (_Inert,), {})


def normalization(path: Path) -> dict[str, Double]:
    """Mean, deviation and clip of observations from the file of a ``VecNormalize``; empty if it does not scale them.

    Raises:
        ConfigError: it is none, or of observations that are no single array.
    """
    with _documents.reading("normalize", path, "a file that VecNormalize.save has written"):
        _documents.require_size(path)
        found = _Reader(io.BytesIO(path.read_bytes())).load()
        state = getattr(found, "state", None)
        if type(found).__name__ != "VecNormalize" or not isinstance(state, dict):
            raise ValueError(f"{type(found).__name__} is none")
        if not state.get("norm_obs", True):
            return {}
        mean, variance = (_array(state["obs_rms"].state[name]) for name in ("mean", "var"))
        return scaling(mean, variance, float(state["epsilon"]), float(state["clip_obs"]))


def scaling(mean: Double, variance: Double, epsilon: float, clip: float) -> dict[str, Double]:
    """Mean, deviation and clip of a ``VecNormalize``."""
    deviation = np.sqrt(variance + epsilon)
    return {"normalize.mean": mean, "normalize.deviation": deviation, "normalize.clip": np.array([clip])}


def _array(pickled: Any) -> Double:
    """A vector of NumPy from its pickled parts, which the protocols of pickle order differently."""
    if pickled.state is None:  # from protocol 5: bytes, type, shape, order
        content, kind, shape, _ = pickled.args
    else:  # version, shape, type, order, bytes
        _, shape, kind, _, content = pickled.state
    if kind.args[0] not in ("f8", "f4") or len(shape) != 1:
        raise ValueError(f"vectors of {kind.args[0]} of shape {shape}, not float64")
    return np.frombuffer(content, f"<{kind.args[0]}", count=shape[0]).astype(np.float64)
