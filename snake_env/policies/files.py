"""Trained networks as safetensors files; ``config`` in the metadata is the run's configuration as JSON text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

Arrays = dict[str, NDArray[np.float32]]

NAME = "policy.safetensors"
"""In the folder of every run."""


def write(path: Path, arrays: Arrays, config: dict[str, Any]) -> None:
    """Writes arrays and the configuration they come from."""
    contiguous = {name: np.ascontiguousarray(array, np.float32) for name, array in arrays.items()}
    # Not `save_file`, whose files nobody but their owner may read.
    path.write_bytes(save(contiguous, metadata={"config": json.dumps(config)}))


def read(path: Path) -> tuple[Arrays, dict[str, Any]]:
    """The arrays and the configuration of a file.

    Raises:
        ValueError: it is not a safetensors file of float32 arrays.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            metadata = file.metadata() or {}
    except SafetensorError as error:
        raise ValueError(f"{path}: expected a safetensors file ({error})") from None
    for name, array in arrays.items():
        if array.dtype != np.float32:
            raise ValueError(f"{path}: {name} is {array.dtype}, expected float32")
    return arrays, json.loads(metadata.get("config", "{}"))
