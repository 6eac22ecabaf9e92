"""Packages that the distribution does not need, and the extras that install them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from gymnasium.error import DependencyNotInstalled

EXTRAS = {
    "scipy": "evaluate",
    "matplotlib": "reproduce",
    "pygame": "render",
    "imageio": "video",
    "PIL": "video",
    "viser": "view",
    "trimesh": "view",
    "stable_baselines3": "sb3",
    "torch": "sb3",
    "onnx": "onnx",
    "onnxruntime": "onnx",
    "pandas": "data",
    "pyarrow": "data",
    "yaml": "yaml",
    "rsl_rl": "rsl-rl",
    "tensordict": "rsl-rl",
    "ray": "ray",
    "mujoco": "mujoco",
}
"""Module -> extra of the distribution that installs it."""


class MissingExtra(DependencyNotInstalled, ImportError):
    """A package is missing that an extra of the distribution installs."""


@contextmanager
def extras() -> Iterator[None]:
    """For imports from such packages.

    Raises:
        MissingExtra: one is missing; names the extra.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        if name not in EXTRAS:
            raise
        raise MissingExtra(f"{name} is missing: pip install 'snake-robot-env[{EXTRAS[name]}]'") from None
