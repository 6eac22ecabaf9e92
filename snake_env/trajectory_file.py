"""Runs as tables: columns with names, and files in which NumPy, pandas and others read them.

Every number has a column: ``position_3_x`` is x of link 3, ``joint_angle_1_yaw`` the yaw of joint 1, both numbered
from 1. Files also hold robot and scene, as JSON: ``.npz`` under ``metadata``, ``.parquet`` in its schema, and ``.csv``
in a file beside it.
"""

from __future__ import annotations

import dataclasses
import json
import math
import tokenize
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import _documents
from snake_env._extras import extras
from snake_env._files import replace, write_json
from snake_env.config import Robot, Scene, scene_file
from snake_env.errors import ConfigError

Array = NDArray[np.float64]
Arrays = dict[str, Array]

FORMAT = "snake_env trajectory 1"

JOINT = ("yaw", "pitch")
COMPONENTS: dict[str, tuple[str, ...]] = {
    "quaternion": ("w", "x", "y", "z"),
    "passive_velocity": ("x", "y", "yaw"),
    **dict.fromkeys(
        ("joint_angle", "joint_torque", "joint_rate", "actuator_power", "motor_power", "electrical_power"), JOINT
    ),
    **dict.fromkeys(("position", "contact_force", "self_contact_force", "velocity", "angular_velocity"), tuple("xyz")),
    **dict.fromkeys(("ground_friction", "obstacle_force", "pair_force"), tuple("xyz")),
    **dict.fromkeys(("obstacle_position", "obstacle_velocity"), tuple("xy")),
}
"""What the last axis of an array means; arrays (T, n) of these names have one number per link or joint."""


def names(name: str, shape: tuple[int, ...]) -> list[str]:
    """Names of the columns of an array (T, ...) of this shape, in the order of its numbers."""
    has_components = name in COMPONENTS and (len(shape) > 1 or name == "passive_velocity")
    counted = shape[:-1] if has_components else shape
    last = COMPONENTS[name][: shape[-1]] if has_components else ()
    rows = ["_".join([name, *(str(k + 1) for k in place)]) for place in np.ndindex(counted)]
    return [f"{row}_{component}" for row in rows for component in last] if last else rows


def columns(arrays: Mapping[str, Array]) -> Arrays:
    """One column (T,) for each number of arrays (T, ...)."""
    return {
        column: array.reshape(len(array), -1)[:, k]
        for name, array in arrays.items()
        for k, column in enumerate(names(name, array.shape[1:]))
    }


def parts(trajectory: Any) -> tuple[Arrays, dict[str, Any]]:
    """The arrays of a run, and all else as JSON has it."""
    fields = {field.name: getattr(trajectory, field.name) for field in dataclasses.fields(trajectory)}
    arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
    scene = {field.name: getattr(trajectory.scene, field.name) for field in dataclasses.fields(trajectory.scene)}
    metadata = {
        "format": FORMAT,
        "shapes": {name: array.shape[1:] for name, array in arrays.items()},
        "robot": dataclasses.asdict(trajectory.robot),
        "scene": scene_file.plain(scene),
    }
    return arrays, metadata | {name: value for name, value in fields.items() if isinstance(value, float)}


def write(trajectory: Any, path: Path) -> None:
    """Writes a run, in the notation that the ending names."""
    arrays, metadata = parts(trajectory)
    replace(path, lambda part: KINDS[path.suffix].write(part, arrays, json.dumps(metadata)))
    if path.suffix == ".csv":
        write_json(path.with_suffix(".json"), metadata)


def read(path: Path) -> dict[str, Any]:
    """The fields of a run.

    Raises:
        ConfigError: the file is none that :func:`write` writes.
        MissingExtra: pyarrow is missing.
    """
    if path.suffix not in KINDS:
        raise ConfigError("path", str(path), f"a name that ends in one of {', '.join(KINDS)}")
    with _documents.reading("path", path, "a file that Trajectory.save has written"):
        found, text = KINDS[path.suffix].read(path)
        metadata = _documents.of_json(text)
        if not isinstance(metadata, dict) or metadata.pop("format", None) != FORMAT:
            raise ValueError(f'no "format": "{FORMAT}"')
        shapes = {name: tuple(shape) for name, shape in metadata.pop("shapes").items()}
        arrays = {name: _array(found, name, shape) for name, shape in shapes.items()}
        if len({len(array) for array in arrays.values()}) != 1:
            raise ValueError("arrays of different lengths")
    robot, scene = Robot.of(metadata.pop("robot", None)), Scene.of(metadata.pop("scene", None))
    return {"robot": robot, "scene": scene, **metadata, **arrays}


def _array(found: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> Array:
    """An array as it is, or from its columns."""
    array = np.empty((len(found["time"]), *shape)) if 0 in shape else found.get(name)
    if array is None:
        if math.prod(shape) > len(found):
            raise ValueError(f"too few columns for {name} of shape {shape}")
        array = np.stack([found[one] for one in names(name, shape)], axis=1).reshape(-1, *shape)
    if array.shape[1:] != shape:
        raise ValueError(f"{name} has the shape {array.shape}, expected (T, {', '.join(map(str, shape))})")
    return np.ascontiguousarray(array, np.float64)


def _write_npz(path: Path, arrays: Arrays, metadata: str) -> None:
    with path.open("wb") as file:  # a name that does not end in .npz gets another ending
        np.savez_compressed(file, metadata=np.array(metadata), **arrays)  # type: ignore[arg-type]


def _read_npz(path: Path) -> tuple[dict[str, Any], str]:
    with np.load(path, allow_pickle=False) as archive:
        try:
            found = dict(archive)
        except (SyntaxError, tokenize.TokenError) as error:  # NumPy parses headers as Python literals
            raise ValueError(f"a damaged header: {error}") from None
    return found, str(found.pop("metadata"))


def _write_csv(path: Path, arrays: Arrays, metadata: str) -> None:
    found = columns(arrays)
    np.savetxt(path, np.stack(list(found.values()), axis=1), "%.17g", ",", header=",".join(found), comments="")


def _read_csv(path: Path) -> tuple[dict[str, Any], str]:
    with path.open(encoding="utf-8") as file:
        head = file.readline().strip().split(",")
        values = np.loadtxt(file, delimiter=",", ndmin=2)
    beside = path.with_suffix(".json")
    _documents.require_size(beside)
    return dict(zip(head, values.T, strict=True)), beside.read_text(encoding="utf-8")


def _write_parquet(path: Path, arrays: Arrays, metadata: str) -> None:
    with extras():
        import pyarrow
        import pyarrow.parquet
    pyarrow.parquet.write_table(pyarrow.table(columns(arrays)).replace_schema_metadata({"snake_env": metadata}), path)


def _read_parquet(path: Path) -> tuple[dict[str, Any], str]:
    with extras():
        import pyarrow.parquet
    table = pyarrow.parquet.read_table(path)
    found = {name: table[name].to_numpy() for name in table.column_names}
    return found, ((table.schema.metadata or {}).get(b"snake_env") or b"{}").decode()


@dataclasses.dataclass(frozen=True)
class _Kind:
    """How a kind of file is written and read."""

    write: Callable[[Path, Arrays, str], None]
    read: Callable[[Path], tuple[dict[str, Any], str]]


KINDS = {
    ".npz": _Kind(_write_npz, _read_npz),
    ".csv": _Kind(_write_csv, _read_csv),
    ".parquet": _Kind(_write_parquet, _read_parquet),
}
"""By the ending."""
