"""What a picture was made from: a record in its file, and how it differs from the present.

A record holds the command, a digest of each policy, a digest of the configuration and of the code that draws, and the
beginning of every run that the picture shows. Runs are numbers that are compared within a tolerance, because a policy's
products of NumPy round differently from processor to processor.
"""

from __future__ import annotations

import hashlib
import inspect
import io
import json
import struct
import textwrap
import tokenize
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Array = NDArray[np.float64]
Record = dict[str, Any]

KEY = "snake_env"
"""Keyword of the text in a PNG file; in a GIF file the record is the comment."""
DECIMALS = 6
"""Of the numbers of a run in a record."""
PNG_HEAD = 33
"""Signature and first chunk of a PNG file [bytes]."""
GIF_HEAD = 13
"""The same of a GIF file, without its table of colours."""


def write(path: Path, record: Record) -> None:
    """Puts a record into a PNG or GIF file that has none; its pixels stay as they are."""
    content, text = path.read_bytes(), json.dumps(record, separators=(",", ":")).encode()
    if path.suffix == ".png":
        chunk = b"tEXt" + KEY.encode() + b"\0" + text
        put = struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))
        at = PNG_HEAD
    else:
        blocks = (text[k : k + 255] for k in range(0, len(text), 255))
        put = b"!\xfe" + b"".join(bytes([len(block)]) + block for block in blocks) + b"\0"
        at = GIF_HEAD + (3 << 1 + (content[10] & 7) if content[10] & 128 else 0)
    path.write_bytes(content[:at] + put + content[at:])


def read(path: Path) -> Record | None:
    """The record of a picture; None: it has none."""
    with Image.open(path) as picture:
        text = picture.info.get(KEY, picture.info.get("comment", b""))
    try:
        return dict(json.loads(text))
    except ValueError:
        return None


def run(numbers: Array) -> list[float]:
    """The beginning of a run as it stands in a record."""
    return [round(float(value), DECIMALS) for value in np.ravel(numbers)]


def differences(stored: Record | None, present: Record, tolerance: Callable[[str], float]) -> Iterator[str]:
    """What of a record is no longer so, in words; ``tolerance`` is that of a run by its name."""
    if stored is None:
        yield "it does not tell what it was made from"
        return
    for part in present:
        if part != "runs" and stored.get(part) != present[part]:
            yield f"{part}: {_changed(stored.get(part), present[part])}"
    for name, numbers in present["runs"].items():
        before = stored["runs"].get(name, [])
        far = np.abs(np.subtract(before, numbers)).max() if len(before) == len(numbers) else np.inf
        if not far <= tolerance(name):
            yield f"run {name}: other by {far:.1e}, tolerance {tolerance(name):.0e}"


def _changed(before: Any, now: Any) -> str:
    if isinstance(before, dict) and isinstance(now, dict):
        return ", ".join(str(key) for key in sorted(before.keys() | now) if before.get(key) != now.get(key))
    return "another"


def digest(content: Any) -> str:
    """Of bytes, or of anything that JSON can hold."""
    data = content if isinstance(content, bytes) else json.dumps(content, sort_keys=True).encode()
    return hashlib.sha256(data).hexdigest()[:16]


def code(*parts: Callable[..., Any] | ModuleType) -> str:
    """Digest of what code does: comments, docstrings and layout do not count.

    Of a module all of it; of a function itself and the functions and plain constants of its file that it uses.
    """
    found: dict[str, str] = {}
    waiting = list(parts)
    while waiting:
        one = waiting.pop()
        name = one.__name__ if isinstance(one, ModuleType) else f"{one.__module__}.{one.__qualname__}"
        if name in found:
            continue
        found[name] = bare(inspect.getsource(one))
        if isinstance(one, ModuleType):
            continue
        function: Any = inspect.unwrap(one)
        for used in _names(function.__code__):
            value = inspect.unwrap(function.__globals__.get(used))
            if inspect.isfunction(value) and value.__module__ == function.__module__:
                waiting.append(value)
            elif isinstance(value, bool | int | float | str | tuple | dict) and _plain(value):
                found[f"{function.__module__}.{used}"] = digest(value)
    return digest(found)


def bare(source: str) -> str:
    """Python source without comments, docstrings and spaces; the same from every version of Python."""
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.ENCODING, tokenize.ENDMARKER}
    marks = {tokenize.INDENT: "»", tokenize.DEDENT: "«", tokenize.NEWLINE: ";"}
    tokens = tokenize.generate_tokens(io.StringIO(textwrap.dedent(source)).readline)
    told = [(one.type, marks.get(one.type, one.string)) for one in tokens if one.type not in skipped]
    said = {
        k
        for k, (kind, _) in enumerate(told)
        if kind == tokenize.STRING and (k == 0 or told[k - 1][0] in marks) and told[k + 1][0] == tokenize.NEWLINE
    }
    kept = [text for k, (_, text) in enumerate(told) if k not in said and k - 1 not in said]
    return "".join("".join(kept).split()).replace("{{", "{").replace("}}", "}")


def _names(compiled: CodeType) -> set[str]:
    """Global names that a function uses, also in what it defines."""
    inner = (one for one in compiled.co_consts if isinstance(one, CodeType))
    return set(compiled.co_names).union(*map(_names, inner))


def _plain(value: Any) -> bool:
    try:
        json.dumps(value, sort_keys=True)
    except TypeError:
        return False
    return True
