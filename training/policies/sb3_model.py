"""Policies that Stable-Baselines3 has trained."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.policies.interface import Stateless, interface


class Model(Stateless):
    """A trained Stable-Baselines3 policy, without exploration noise."""

    def __init__(self, path: Path, name: str = "policy", env_options: dict[str, Any] | None = None) -> None:
        from stable_baselines3 import PPO

        self._set(PPO.load(path, device="cpu"), name, env_options or {})

    @classmethod
    def of(cls, model: Any, env_options: dict[str, Any]) -> Model:
        """The policy of a model in training."""
        made = cls.__new__(cls)
        made._set(model, "policy", env_options)
        return made

    def _set(self, model: Any, name: str, env_options: dict[str, Any]) -> None:
        self.name, self._model = name, model
        self.env_options = interface(env_options)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The mean actions (n, a)."""
        return self._model.predict(observation, deterministic=True)[0]
