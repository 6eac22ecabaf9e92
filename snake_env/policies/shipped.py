"""The trained policies that come with the package."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER = Path(__file__).parent / "shipped"
NAMES = tuple(sorted(path.stem for path in FOLDER.glob("*.safetensors")))
"""``"field-hard"`` and others; ``snake-env card`` lists them."""


def policy_path(policy: str | os.PathLike[str]) -> Path:
    """The file of a shipped policy, or ``policy`` itself if it is a path."""
    return FOLDER / f"{policy}.safetensors" if str(policy) in NAMES else Path(policy)
