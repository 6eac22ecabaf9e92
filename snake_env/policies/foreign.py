"""Policies of other packages, and functions, as policies."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.errors import ConfigError
from snake_env.policies.interface import Policy, PolicyBase, Stateless, task_keywords
from snake_env.policies.network import Scaling
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.sb3_zip import normalization
from snake_env.policies.wrappers import normalization_of, spec_of

Normalize = str | os.PathLike[str] | Literal[False] | None

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
        trained = [part for part in self._act.modules() if part.training]
        device = next((one.device for one in self._act.parameters()), None)
        try:
            for part in trained:
                part.training = False
            with self._torch.no_grad():
                action: NDArray[np.float32] = self._act(self._torch.tensor(observation, device=device)).cpu().numpy()
        finally:
            for part in trained:
                part.training = True
        return action


class Model(PolicyBase):
    """A model of Stable-Baselines3, or its policy, without exploration noise.

    Observations are scaled by the ``VecNormalize`` in a file, or by that of the model's environment. One that remembers
    is told where episodes begin.

    Args:
        model: has ``predict``.
        card: what it is; None: of its class, trained in the model's environment.
        env_options: keywords of the environment, on top of those of the card.
        normalize: file of a ``VecNormalize``; None: that of the model's environment; False: none.

    Raises:
        ConfigError: a wrapper of the model's environment changes observations or actions.
    """

    def __init__(
        self,
        model: Any,
        card: PolicyCard | None = None,
        env_options: Mapping[str, Any] | None = None,
        normalize: Normalize = None,
    ) -> None:
        env = model.get_env() if hasattr(model, "get_env") else None
        spec = None if env is None else spec_of(env)
        card = card or PolicyCard(type(model).__name__)
        if spec is not None and card.env_id is None:
            card = replace(card, env_id=spec.id, env_options=task_keywords(spec))
        super().__init__(card)
        self.env_options |= env_options or {}
        self._scaled: Any = None
        self._model, self._state, self._begins = model, None, np.ones(0, np.bool_)
        own = None if env is None else normalization_of(env)
        if normalize:
            self._scaled = _scaling(Path(normalize))
        elif normalize is None and own is not None:
            self.scale_as(own)

    def scale_as(self, normalization: Any) -> None:
        """Takes the statistics of a ``VecNormalize`` unless it has some."""
        self._scaled = self._scaled or normalization.normalize_obs

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
        seen = observation if self._scaled is None else self._scaled(observation)
        action, self._state = self._model.predict(seen, self._state, self._begins, deterministic=True)
        self._begins = np.zeros(len(observation), np.bool_)
        found: NDArray[np.float32] = action
        return found


def _scaling(statistics: Path) -> Any:
    found = normalization(statistics)
    if not found:
        return lambda observation: observation
    scaling = Scaling(*found.values())
    return lambda observation: scaling(observation).astype(np.float32)


def refuse_statistics(normalize: Normalize, name: str) -> None:
    """Refuses the file of a ``VecNormalize`` for a policy that takes none.

    Raises:
        ConfigError: names the policy.
    """
    if normalize:
        raise ConfigError("normalize", str(normalize), f"None for {name}: it is of zips and of models")


def of_object(
    policy: Any, env_options: Mapping[str, Any], name: str | None = None, normalize: Normalize = None
) -> Policy:
    """A policy as it is, or what acts in its place: a model of Stable-Baselines3, a module of torch, a function.

    Raises:
        ConfigError: it is nothing that acts, or takes no statistics or no options.
    """
    if hasattr(policy, "predict") and hasattr(policy, "observation_space"):
        return Model(policy, PolicyCard(name or type(policy).__name__), env_options, normalize)
    refuse_statistics(normalize, name or str(getattr(policy, "name", type(policy).__name__)))
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


def of_sb3_zip(path: Path, card: PolicyCard, normalize: Normalize) -> Model:
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
    return Model(made, card, normalize=normalize)


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
