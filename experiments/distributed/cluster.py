"""The Ray cluster that commands run on."""

from __future__ import annotations

from importlib.util import find_spec

from snake_env import ConfigError

MODULES = {"ray": ("Ray", "ray"), "rllib": ("RLlib", "ray.rllib")}
"""By extra of the package: what it installs."""

REMEDY = "`make .venv-ray/.packages` makes an environment with it; then PYTHONPATH=. .venv-ray/bin/python -m ..."


def require(extra: str) -> None:
    """Raises unless an extra of the package is installed.

    Raises:
        ConfigError: explains how to install it.
    """
    name, module = MODULES[extra]
    if find_spec("ray") is None or find_spec(module) is None:
        raise ConfigError(name, "missing", REMEDY)


def join(address: str | None) -> None:
    """Connects to the cluster, unless that has been done."""
    import ray

    if not ray.is_initialized():
        ray.init(address=address, include_dashboard=False)
