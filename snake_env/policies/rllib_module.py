"""The actor of RLlib's PPO as a policy of this package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from snake_env.policies import files


def save(algorithm: Any, path: Path, card: dict[str, Any]) -> Path:
    """Writes it as a file that every command takes.

    Args:
        algorithm: of the settings of :mod:`snake_env.rllib`.
        path: ends in .safetensors.
        card: what the file says about the policy, such as ``env_id`` and ``env``.
    """
    state = algorithm.get_module().state_dict()
    layers = [
        *sorted(name for name in state if name.startswith("encoder.actor_encoder.") and name.endswith(".weight")),
        *sorted(name for name in state if name.startswith("pi.") and name.endswith(".weight")),
    ]
    arrays = {}
    for k, name in enumerate(layers):
        is_last = k + 1 == len(layers)
        for part in ("weight", "bias"):
            values = state[f"{name.removesuffix('weight')}{part}"].numpy()
            # The last layer has means, then logarithms of deviations.
            arrays[f"actor.{k}.{part}"] = values[: len(values) // 2] if is_last else values
    files.write(path, arrays, card)
    return path
