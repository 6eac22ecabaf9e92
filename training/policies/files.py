"""Trained networks as small files: safetensors, read and written with NumPy alone.

A file is the length of its header (eight bytes, little endian), the header (JSON: type, shape and place of each
array, and ``__metadata__``, strings by name) and the arrays. The metadata hold ``config``, the JSON text of the
training run's configuration. Nothing in such a file is ever executed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[np.float32]]

NAME = "policy.safetensors"
"""In the folder of every run."""

LONGEST_HEADER = 10**8
"""Bytes; what the format allows."""


def write(path: Path, arrays: Arrays, config: dict[str, Any]) -> None:
    """Writes arrays (float32) and the configuration they come from."""
    header: dict[str, Any] = {"__metadata__": {"config": json.dumps(config)}}
    end = 0
    for name, array in arrays.items():
        begin, end = end, end + array.size * 4
        header[name] = {"dtype": "F32", "shape": list(array.shape), "data_offsets": [begin, end]}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    content = b"".join(np.ascontiguousarray(array, "<f4").tobytes() for array in arrays.values())
    path.write_bytes(len(text).to_bytes(8, "little") + text + content)


def read(path: Path) -> tuple[Arrays, dict[str, Any]]:
    """The arrays and the configuration of a file.

    Raises:
        ValueError: the file is not what :func:`write` writes; names the file and what is wrong.
    """
    content = path.read_bytes()
    size = int.from_bytes(content[:8], "little")
    if len(content) < 8 or size > min(LONGEST_HEADER, len(content) - 8):
        raise ValueError(f"{path}: expected a safetensors file, found a header of {size} in {len(content)} bytes")
    header = json.loads(content[8 : 8 + size])
    config = json.loads(header.pop("__metadata__", {}).get("config", "{}"))
    body = memoryview(content)[8 + size :]
    return {name: _array(path, name, entry, body) for name, entry in header.items()}, config


def _array(path: Path, name: str, entry: dict[str, Any], body: memoryview) -> NDArray[np.float32]:
    begin, end = entry["data_offsets"]
    if entry["dtype"] != "F32" or end > len(body):
        raise ValueError(f"{path}: {name} = {entry}: expected float32 within {len(body)} bytes")
    return np.frombuffer(body[begin:end], "<f4").reshape(entry["shape"]).astype(np.float32)
