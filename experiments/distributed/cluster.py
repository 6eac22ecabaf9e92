"""The Ray cluster that commands run on."""

from __future__ import annotations

import argparse
import sys
from importlib.util import find_spec

MODULES = {"ray": ("Ray", "ray"), "rllib": ("RLlib", "ray.rllib")}
"""By extra of the package: what it installs."""

REMEDY = "`make .venv-ray/.packages` makes an environment with it; then PYTHONPATH=. .venv-ray/bin/python -m ..."


def add_address(cli: argparse.ArgumentParser) -> None:
    """Adds the option that says which cluster."""
    cli.add_argument("--address", help="of a running cluster, or 'auto'; without it Ray starts on this machine")


def installed(extra: str) -> bool:
    """Whether an extra of the package is installed; says how to if it is not."""
    name, module = MODULES[extra]
    found = find_spec("ray") is not None and find_spec(module) is not None
    if not found:
        print(f"{name} is not installed. {REMEDY}", file=sys.stderr)
    return found


def join(address: str | None) -> None:
    """Connects to the cluster, unless that has been done."""
    import ray

    if not ray.is_initialized():
        ray.init(address=address, include_dashboard=False)
