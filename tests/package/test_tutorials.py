"""The notebooks of the documentation run as they stand, and are notebooks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs/tutorials"
NOTEBOOKS = sorted(path.name for path in FOLDER.glob("*.py"))


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs(name, tmp_path):
    pytest.importorskip("matplotlib")
    if "stable_baselines3" in (FOLDER / name).read_text(encoding="utf-8"):
        pytest.importorskip("stable_baselines3")
    command = [sys.executable, "-W", "error::UserWarning:__main__", str(FOLDER / name)]
    settings = {**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(FOLDER.parents[1])}
    done = subprocess.run(command, cwd=tmp_path, env=settings, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout, "a notebook prints what it has found"


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_begins_with_a_title_and_alternates_text_and_code(name):
    text = (FOLDER / name).read_text(encoding="utf-8")
    cells = re.findall(r"^# %%(?P<kind> \[markdown\])?\n(?P<body>.*?)(?=^# %%|\Z)", text, re.MULTILINE | re.DOTALL)
    assert cells[0][0], name
    assert cells[0][1].startswith("# # "), name
    assert len(cells) >= 6, name


def test_every_notebook_is_listed():
    listed = re.findall(r"tutorials/(\w+\.py)$", (FOLDER.parents[1] / "mkdocs.yml").read_text(encoding="utf-8"), re.M)
    assert sorted(listed) == NOTEBOOKS
