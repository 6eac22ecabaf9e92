"""Trained networks as safetensors files; ``config`` in the metadata is the run's configuration as JSON text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from snake_env import _documents
from snake_env._files import replace

Arrays = dict[str, NDArray[np.float32]]

NAME = "policy.safetensors"
"""In the folder of every run."""


def write(path: Path, arrays: Arrays, config: dict[str, Any]) -> None:
    """Writes arrays and the configuration they come from."""
    contiguous = {name: np.ascontiguousarray(array, np.float32) for name, array in arrays.items()}
    # Not `save_file`, whose files nobody but their owner may read.
    content = save(contiguous, metadata={"config": json.dumps(config)})
    replace(path, lambda part: part.write_bytes(content))


def read(path: Path) -> tuple[Arrays, dict[str, Any]]:
    """The arrays and the configuration of a file.

    Raises:
        ValueError: it is not a safetensors file of float32 arrays, too large, or its configuration is not a mapping.
    """
    _documents.require_size(path)
    try:
        with safe_open(path, framework="numpy") as file:
            names = list(file.keys())
            for name in names:
                kind = file.get_slice(name).get_dtype()
                if kind != "F32":
                    raise ValueError(f"{path}: {name} is {kind}, expected F32, float32")
            arrays = {name: file.get_tensor(name) for name in names}
            metadata = file.metadata() or {}
    except SafetensorError as error:
        raise ValueError(f"{path}: expected a safetensors file ({error})") from None
    config = _documents.of_json(metadata.get("config", "{}"))
    if not isinstance(config, dict):
        raise ValueError(f"{path}: the configuration is {config!r}, expected a mapping")
    return arrays, config
