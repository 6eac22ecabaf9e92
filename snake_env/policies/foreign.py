"""Policies of other packages, and functions, as policies."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.errors import ConfigError
from snake_env.policies.interface import INTERFACE, Policy, Stateless, Trained, task_keywords
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.sb3_zip import normalization

UNTRUSTED = (
    "a file that is safe to read; this one can run any code: if you trust where it comes from, "
    "say so with trust=True, or --trust"
)
"""What a file is expected to be that holds a pickle."""


class Function(Stateless):
    """A function of observations (n, o) that returns actions (n, a), or a module of torch.

    Args:
        act: the function.
        env_options: what it needs of the environment.
        name: shown in tables; by default its own.
    """

    def __init__(self, act: Any, env_options: Mapping[str, Any], name: str | None = None) -> None:
        if not callable(act):
            raise ConfigError("policy", repr(act), "a policy, or a function of observations")
        self.name: str = name or str(getattr(act, "__name__", type(act).__name__)).strip("<>")
        self.env_options = dict(env_options)
        torch = sys.modules.get("torch")
        self._torch = torch if torch is not None and isinstance(act, torch.nn.Module) else None
        self._act = act

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions."""
        if self._torch is None:
            found: NDArray[np.float32] = self._act(observation)
            return found
        with self._torch.no_grad():
            action: NDArray[np.float32] = self._act(self._torch.from_numpy(observation.copy())).numpy()
        return action


class Model(Trained):
    """A model of Stable-Baselines3, or its policy, without exploration noise.

    Observations are scaled by the ``VecNormalize`` in a file, or by that of the model's environment. One that remembers
    is told where episodes begin.

    Args:
        model: has ``predict``.
        name: shown in tables.
        env_options: keywords of the environment; by default those of the model's.
        statistics: file of a ``VecNormalize``.
    """

    def __init__(
        self,
        model: Any,
        name: str | None = None,
        env_options: Mapping[str, Any] | None = None,
        statistics: Path | None = None,
    ) -> None:
        env = model.get_env() if hasattr(model, "get_env") else None
        spec = None if env is None else env.unwrapped.spec
        card = PolicyCard(name or type(model).__name__)
        if spec is not None:
            card = PolicyCard(card.name, env_id=spec.id, env_options=task_keywords(spec.kwargs))
        super().__init__(card)
        self.env_options |= env_options or {}
        scales = model.get_vec_normalize_env() if hasattr(model, "get_vec_normalize_env") else None
        self._scaled = _scaling(statistics) if scales is None or statistics is not None else scales.normalize_obs
        self._model, self._state, self._begins = model, None, np.ones(0, np.bool_)

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Forgets everything.

        Raises:
            ConfigError: the environment's observations are not those of the training.
        """
        shown = sum(block["size"] for block in layout["observation"])
        shape = self._model.observation_space.shape or (0,)  # of a mapping of arrays, which is refused
        self.require_inputs(shown, shape[0])
        self._state, self._begins = None, np.ones(num_envs, np.bool_)

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """Tells the model about episodes that begin."""
        self._begins |= rows

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        if len(self._begins) != len(observation):
            self._state, self._begins = None, np.ones(len(observation), np.bool_)
        seen = self._scaled(observation)
        action, self._state = self._model.predict(seen, self._state, self._begins, deterministic=True)
        self._begins = np.zeros(len(observation), np.bool_)
        found: NDArray[np.float32] = action
        return found


def _scaling(statistics: Path | None) -> Any:
    found = {} if statistics is None else normalization(statistics)
    if not found:
        return lambda observation: observation
    mean, deviation, clip = found.values()
    return lambda observation: np.clip((observation - mean) / deviation, -clip, clip).astype(np.float32)


def of_object(
    policy: Any, env_options: Mapping[str, Any], name: str | None = None, statistics: Path | None = None
) -> Policy:
    """A policy as it is, or what acts in its place: a model of Stable-Baselines3, a module of torch, a function.

    Raises:
        ConfigError: it is nothing that acts.
    """
    for key, value in env_options.items():
        if key not in INTERFACE:
            expected = f"one of {', '.join(INTERFACE)}; others are the task's"
            raise ConfigError(f"env_options[{key!r}]", repr(value), expected)
    if hasattr(policy, "predict") and hasattr(policy, "observation_space"):
        return Model(policy, name, env_options, statistics)
    if not hasattr(policy, "begin"):
        return Function(policy, env_options, name)
    missing = [part for part in ("name", "env_options", "reset") if not hasattr(policy, part)]
    if missing:
        expected = "name, env_options, begin and reset, as snake_env.policies.Policy describes them, or a function"
        raise ConfigError("policy", f"{type(policy).__name__} without {', '.join(missing)}", expected)
    if env_options:
        raise ConfigError("env_options", repr(env_options), "none, the policy has its own")
    acts: Policy = policy
    return acts


def of_sb3_zip(path: Path, name: str, statistics: Path | None) -> Model:
    """The policy in a zip file of Stable-Baselines3, made by its own code, which the file chooses.

    Raises:
        MissingExtra: Stable-Baselines3 is missing.
    """
    with extras():
        from stable_baselines3.common.save_util import load_from_zip_file

    data, parameters, _ = load_from_zip_file(path, device="cpu")
    assert data is not None
    settings = ({"use_sde": True} if data.get("use_sde") else {}) | data.get("policy_kwargs", {})
    made = data["policy_class"](data["observation_space"], data["action_space"], lambda _: 0.0, **settings)
    made.load_state_dict(parameters["policy"])
    made.set_training_mode(False)
    return Model(made, name, statistics=statistics)


def of_torch(path: Path, name: str, env_options: Mapping[str, Any]) -> Function:
    """A pickled module of torch, one of TorchScript, or an exported program (.pt2).

    Raises:
        MissingExtra: torch is missing.
    """
    with extras():
        import torch
    if path.suffix == ".pt2":
        return Function(torch.export.load(path).module(), env_options, name)
    made = torch.load(path, map_location="cpu", weights_only=False)
    if not isinstance(made, torch.nn.Module):
        raise ValueError(f"{path}: {type(made).__name__}, expected a module of torch, not only its weights")
    return Function(made.eval(), env_options, name)
