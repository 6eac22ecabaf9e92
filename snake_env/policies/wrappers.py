"""What an environment that a user hands over is beneath its wrappers, of Gymnasium and of Stable-Baselines3."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from snake_env.errors import ConfigError

CHANGING = (
    *(gym.ObservationWrapper, gym.ActionWrapper),
    *(gym.vector.VectorObservationWrapper, gym.vector.VectorActionWrapper),
)
SPACES = ("observation_space", "action_space")


def spec_of(env: Any) -> Any:
    """The spec of an environment, single or batch; None if it has none."""
    spec = getattr(env, "spec", None)
    return env.get_attr("spec")[0] if spec is None and hasattr(env, "get_attr") else spec


def normalization_of(env: Any) -> Any:
    """The ``VecNormalize`` of an environment that scales observations; None if there is none.

    Raises:
        ConfigError: names another wrapper that changes observations or actions, without which the policy would act.
    """
    found = None
    while (inner := _inside(env)) is not None:
        if type(env).__name__ == "VecNormalize":
            found = env if env.norm_obs else found
        elif isinstance(env, CHANGING) or _spaces(env) != _spaces(inner):
            expected = "an environment whose wrappers change neither observations nor actions, except VecNormalize"
            raise ConfigError("env", type(env).__name__, expected)
        env = inner
    return found


def _inside(env: Any) -> Any:
    """What a wrapper wraps, or one of the environments of a batch; None: nothing."""
    if isinstance(env, gym.Wrapper | gym.vector.VectorWrapper):
        return env.env
    own = getattr(env, "__dict__", {})
    return own.get("venv") or next(iter(own.get("envs", ())), None)


def _spaces(env: Any) -> tuple[Any, ...]:
    """Of one robot."""
    return tuple(getattr(env, f"single_{name}", getattr(env, name)) for name in SPACES)
