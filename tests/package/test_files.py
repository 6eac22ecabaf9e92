"""Files are written whole or not at all, all by one function."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

import pytest

from snake_env._files import replace, write_json, write_text

ROOT = Path(__file__).parents[2]


def test_a_write_that_fails_leaves_what_was_there(tmp_path):
    path = tmp_path / "file.txt"
    write_text(path, "before")

    def fail(part):
        part.write_text("half")
        raise OSError("the disk is full")

    with pytest.raises(OSError, match="full"):
        replace(path, fail)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_being_written_has_the_ending_and_is_not_seen_under_the_name(tmp_path):
    path = tmp_path / "film.mp4"

    def write(part):
        assert part.suffix == ".mp4"
        assert not path.exists()
        part.write_text("film")

    replace(path, write)
    assert path.read_text() == "film"


def test_links_pipes_and_permissions_are_kept(tmp_path):
    target = tmp_path / "target.json"
    (tmp_path / "link.json").symlink_to(target)
    write_json(tmp_path / "link.json", {"a": 1})
    assert target.read_text() == '{\n  "a": 1\n}\n'
    assert (tmp_path / "link.json").is_symlink()
    mask = os.umask(0o022)
    os.umask(mask)
    assert stat.S_IMODE(target.stat().st_mode) == 0o666 & ~mask, "others may read it, as any file"
    write_text("/dev/null", "gone")
    assert Path("/dev/null").is_char_device()


WRITES = re.compile(
    r"\.write_(text|bytes)\(|\bopen\([^)]*[\"'][wax]b?\+?[\"']|savefig\(|get_writer\(|torch\.save\(|\.safe_dump\("
)

INSIDE = {
    "snake_env/_files.py": 1,
    "snake_env/policies/files.py": 1,
    "snake_env/policies/onnx_file.py": 1,
    "snake_env/trajectory_file.py": 1,
    "snake_env/drawing.py": 1,
    "snake_env/evaluation/film.py": 1,
    "training/learners/ppo.py": 1,
    "training/learners/evolution.py": 1,
    # A lock, a line that is added to a curve, a log that grows, a file that no other process reads.
    "training/runs.py": 2,
    "training/search/sweep.py": 1,
    # A file in a temporary folder, which is then put in its place.
    "experiments/origin.py": 1,
}
"""Lines that write to what `replace` hands them, and the few that need no whole file."""


def test_no_other_function_writes_files():
    found = {}
    for folder in ("snake_env", "training", "experiments", "benchmarks"):
        for path in (ROOT / folder).rglob("*.py"):
            lines = [line for line in path.read_text().splitlines() if WRITES.search(line)]
            if lines := [line for line in lines if "safe_dump" not in line or "write_text" not in line]:
                found[path.relative_to(ROOT).as_posix()] = len(lines)
    assert found == INSIDE
