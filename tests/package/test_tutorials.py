"""The notebooks of the documentation run as they stand, those for Colab too, which install the package."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import run_python

from experiments import notebooks

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


def code_of(text):
    """The code cells of a notebook."""
    return ["".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize("name", list(notebooks.notebooks()))
def test_a_notebook_for_colab_is_up_to_date_and_runs(name, tmp_path, monkeypatch):
    text = (notebooks.FOLDER / name).read_text(encoding="utf-8")
    assert text == notebooks.notebooks()[name], "run `make docs`"
    code = "\n".join(code_of(text)).replace("learn(500_000)", "learn(4_096)")
    for module in ("stable_baselines3", "matplotlib", "pygame"):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    run_python(code, timeout=200)


@pytest.mark.parametrize(("address", "source"), [("", ""), ("https://host/me/snake", " @ git+https://host/me/snake")])
def test_a_notebook_installs_the_package_where_it_is_missing(address, source, monkeypatch):
    install, *_ = code_of(notebooks.notebook("simulate.md"))
    called = []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: called.append(command))
    exec(install)
    assert called == []
    monkeypatch.setitem(sys.modules, "snake_env", None)
    exec(install.replace('REPOSITORY = ""', f'REPOSITORY = "{address}"'))
    assert called[0][1:4] == ["-m", "pip", "install"]
    assert called[0][-1] == f"snake-robot-env[{notebooks.EXTRAS}]{source}"
