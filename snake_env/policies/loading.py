"""Whatever acts, by name: the one place that knows what names and files there are."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from snake_env import _documents
from snake_env.errors import ConfigError
from snake_env.policies import foreign, sb3_zip
from snake_env.policies.gaits import DEGREE, GaitParameters, GaitPolicy
from snake_env.policies.interface import INTERFACE, title
from snake_env.policies.network import Network
from snake_env.policies.onnx_file import OnnxPolicy
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.scripted import catalogue
from snake_env.policies.shipped import NAMES, policy_path
from snake_env.registration import TASKS

GAIT = "gait"
"""The default gait of the environment, action zero: in the plane lateral undulation (T 7.3)."""

SCRIPTED = tuple(name.replace(" ", "-") for name in catalogue.CONTROLLERS)

BLOCKS = "observation_blocks"

FILES = "a file (.safetensors, .onnx, .zip of Stable-Baselines3, .pt of torch), module:function"

CHOICES = f"{GAIT}, A,omega,beta in degrees, {', '.join((*SCRIPTED, *NAMES))}, {FILES}"
"""What may be named."""


def load_policy(
    policy: Any,
    *,
    task: str | None = None,
    normalize: str | os.PathLike[str] | Literal[False] | None = None,
    trust: bool = False,
    env_options: Mapping[str, Any] | None = None,
    name: str | None = None,
) -> Any:
    """A policy by its name, from a file, or from what acts.

    Called with observations (n, o) it gives actions (n, a) in [-1, 1]. Trained policies have ``.card``, which says what
    they are and how they scored, and ``.make_vec(num_envs)``, the environment in which they were trained. The shipped
    ones, and networks of linear layers from files, run with NumPy only. The action of a robot does not depend on the
    other robots.

    Args:
        policy: name of a shipped policy (``snake_env.policies.NAMES``) or of a scripted controller such as
            ``"heading-control"``. Or ``"gait"``, the default gait; or a gait as amplitude, frequency and phase shift,
            ``"30,120,-50"`` (degrees and degrees per second). Or a file: ``.safetensors`` of a run, ``.zip`` of
            Stable-Baselines3, ``.onnx``, or a module of torch (``.pt``, ``.pth``, ``.pt2``). Or ``"module:name"``, a
            function or class that Python imports. Or an object: a :class:`snake_env.policies.Policy`, a model of
            Stable-Baselines3, a ``torch.nn.Module``, a function of observations.
        task: of the benchmark, for whose scenes a scripted controller was tuned; by default those that are hardest.
        normalize: file of the ``VecNormalize`` of a zip or a model. By default ``vecnormalize.pkl`` or
            ``<name>_vecnormalize.pkl`` beside a zip, or that of the same checkpoint; and that of a model's environment.
            False: none.
        trust: the file may run code: needed for modules of torch, and for a zip whose network is not of linear layers.
        env_options: what a function or file needs of the environment: ``action_mode``, ``perception``,
            ``nearest_pegs``, ``observation_blocks``, ``privileged`` and ``control_period``; of a gait or scripted
            controller ``observation_blocks`` only.
        name: shown in tables; by default its own.

    Raises:
        ConfigError: there is no such policy, or its file is of another kind or not trusted; or it takes no
            ``normalize`` or ``env_options``.
        MissingExtra: a package is missing that an extra installs.
    """
    options = dict(env_options or {})
    for key, value in options.items():
        if key not in INTERFACE:
            expected = f"one of {', '.join(INTERFACE)}; others are the task's"
            raise ConfigError(f"env_options[{key!r}]", repr(value), expected)
    if not isinstance(policy, str | os.PathLike):
        return foreign.of_object(policy, options, name, normalize)
    text = str(policy)
    path = policy_path(text)
    if text in (GAIT, *SCRIPTED, *catalogue.CONTROLLERS) or not os.path.isfile(path):
        return _named(text, task, options, name, normalize)
    with _documents.reading("policy", text, "a file that can be read"):
        found = _of_file(path, name or title(path), normalize, trust, options)
    found.env_options |= options
    return found


def _of_file(path: Path, name: str, normalize: Any, trust: bool, options: dict[str, Any]) -> Any:
    if path.suffix != ".zip":
        foreign.refuse_statistics(normalize, path.name)
    if path.suffix == ".safetensors":
        return Network(path, name)
    if path.suffix == ".onnx":
        return OnnxPolicy(path, name)
    if path.suffix == ".zip":
        statistics = _statistics(path) if normalize is None else Path(normalize) if normalize else None
        try:
            return Network(path, name, partial(_of_sb3_zip, statistics=statistics))
        except sb3_zip.OtherNetwork as error:
            if not trust:
                raise ConfigError("policy", str(path), f"{foreign.UNTRUSTED} ({error})") from None
            card = PolicyCard.of(name, _trained_in(path, statistics), path.with_suffix(".json"))
            return foreign.of_sb3_zip(path, card, statistics or False)
    if path.suffix in (".pt", ".pth", ".pt2"):
        if not trust:
            raise ConfigError("policy", str(path), foreign.UNTRUSTED)
        return foreign.of_torch(path, name, options)
    raise ConfigError("policy", str(path), FILES)


def _of_sb3_zip(path: Path, statistics: Path | None) -> tuple[Any, dict[str, Any]]:
    """The network of a zip, and where it was trained if it lies in the folder of a run of ``python -m training``."""
    arrays, config = sb3_zip.read(path)
    arrays |= {} if statistics is None else sb3_zip.normalization(statistics)
    return arrays, config | _trained_in(path, statistics)


def _trained_in(path: Path, statistics: Path | None) -> dict[str, Any]:
    """What is known about the policy in a zip."""
    about = "" if statistics is None else f", observations normalised by {statistics.name}"
    config = {"about": f"Network of Stable-Baselines3{about}."}
    beside = path.with_name("config.json")
    run = _documents.read(beside) if beside.is_file() else {}
    if isinstance(run, dict) and run.get("env_id") in TASKS and isinstance(run.get("env"), dict):
        config |= {"env_id": run["env_id"], "env": run["env"]}
    return config


def _statistics(path: Path) -> Path | None:
    """The file of the ``VecNormalize`` beside a zip, by the names that callbacks of Stable-Baselines3 give it."""
    names = [f"{path.stem}_vecnormalize.pkl", "vecnormalize.pkl", "vec_normalize.pkl"]
    prefix, _, steps = path.stem.removesuffix("_steps").rpartition("_")
    if prefix:
        names.insert(0, f"{prefix}_vecnormalize_{steps}_steps.pkl")
    return next(filter(Path.is_file, map(path.with_name, names)), None)


def _named(text: str, task: str | None, options: dict[str, Any], name: str | None, normalize: Any) -> Any:
    """A gait, also by its numbers, a scripted controller, or what Python imports."""
    module, colon, attribute = text.partition(":")
    if not colon:
        found = _of_this_package(text, task)
        foreign.refuse_statistics(normalize, text)
        if set(options) - {BLOCKS}:
            raise ConfigError("env_options", repr(options), f"{BLOCKS} only for {text}, which has its own")
        found.env_options |= options
        return found
    if not all(part.isidentifier() for part in (*module.split("."), attribute)):
        raise ConfigError("policy", text, f"one of {CHOICES}")
    here = os.getcwd()  # where people write the module; a command's own path is that of its script
    sys.path.insert(0, here)
    try:
        made = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ConfigError("policy", text, f"module:name that Python can import ({error})") from None
    finally:
        sys.path.remove(here)
    return foreign.of_object(made() if isinstance(made, type) else made, options, name, normalize)


def _of_this_package(text: str, task: str | None) -> Any:
    scripted = text.replace("-", " ")
    if scripted in catalogue.CONTROLLERS:
        return catalogue.tuned(scripted, task)
    if text == GAIT:
        return GaitPolicy()
    try:
        amplitude, omega, beta = (float(part) * DEGREE for part in text.split(","))
    except ValueError:
        raise ConfigError("policy", text, f"one of {CHOICES}") from None
    return GaitPolicy(GaitParameters(amplitude, omega, beta))
