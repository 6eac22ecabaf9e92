"""The trained policies that come with the package, and policies from files."""

from __future__ import annotations

import os
from pathlib import Path

from snake_env.errors import ConfigError
from snake_env.policies.network import Network

FOLDER = Path(__file__).parent / "shipped"
NAMES = tuple(sorted(path.stem for path in FOLDER.glob("*.safetensors")))
"""``"field-hard"`` and others; ``snake-env card`` lists them."""


def policy_path(policy: str | os.PathLike[str]) -> Path:
    """The file of a shipped policy, or ``policy`` itself if it is a path."""
    return FOLDER / f"{policy}.safetensors" if str(policy) in NAMES else Path(policy)


def load_policy(policy: str | os.PathLike[str]) -> Network:
    """A trained policy, which runs with NumPy only.

    Called with observations (n, o) or (o,) it gives actions (n, a) or (a,) in [-1, 1]; the action of a robot does not
    depend on the other robots in the batch. ``.card`` says what it is and how it scored, ``.make_vec(num_envs)`` makes
    the environment in which it was trained.

    Args:
        policy: Name of a shipped policy (``snake_env.policies.NAMES``), or path of a ``policy.safetensors`` of a run.

    Raises:
        ConfigError: no policy has this name and there is no such file, or the file is of another kind.
    """
    path = policy_path(policy)
    if not os.path.isfile(path):
        raise ConfigError("policy", str(policy), f"one of {', '.join(NAMES)}, or the path of a policy.safetensors")
    try:
        return Network(path)
    except ConfigError:
        raise
    except (ValueError, OSError) as error:
        raise ConfigError("policy", str(policy), f"a policy.safetensors of a run ({error})") from None
