"""The documentation site builds without a warning, and its links lead somewhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ADDRESS = "https://host/me/snake"
pytestmark = pytest.mark.timeout(900)  # the notebooks are executed


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("mkdocs")
    pytest.importorskip("mkdocstrings")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    settings = {**os.environ, "REPOSITORY": ADDRESS}
    done = subprocess.run(command, cwd=ROOT, env=settings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def test_pages_and_pictures_that_are_linked_exist(site):
    pages = [page for page in site.rglob("*.html") if page.name != "404.html"]
    assert len(pages) > 25
    for page in pages:
        for target in re.findall(r'(?:href|src)="([^"#?]+)[^"]*"', page.read_text(encoding="utf-8")):
            if not re.match(r"[a-z]+:", target):
                assert (page.parent / target).exists(), f"{page.relative_to(site)}: {target}"


def test_the_reference_links_what_docstrings_name(site):
    """A role of Sphinx, which these pages are not made with, is a link or plain code."""
    text = (site / "api/index.html").read_text(encoding="utf-8")
    assert not re.search(r":(?:attr|class|data|exc|func|meth|mod):", text)
    assert '<a href="#snake_env.Scene"><code>Scene</code></a>' in text


def test_the_reference_describes_what_the_contract_names(site):
    text = (site / "api/index.html").read_text(encoding="utf-8")
    for name in ("simulate", "Trajectory", "SnakeVectorEnv", "policies.loading.load_policy", "Scene", "Randomization"):
        assert f'id="snake_env.{name}"' in text


def test_programs_find_the_pages_in_a_list(site):
    text = (site / "llms.txt").read_text(encoding="utf-8")
    rows = re.findall(r"^- \[(.+)\]\((.+?)\): (.*)$", text, re.MULTILINE)
    assert len(rows) > 25
    assert all((site / target).exists() for _, target, _ in rows)
    assert sum(len(words) > 20 for _, _, words in rows) > 20


def test_pages_that_are_notebooks_open_in_colab(site):
    found = {
        str(page.parent.relative_to(site)): link
        for page in site.rglob("*.html")
        for link in re.findall(r'href="(https://colab[^"]*)"', page.read_text(encoding="utf-8"))
    }
    assert set(found) == {"simulate", "training", "tutorials/spatial"}
    for link in found.values():
        owner, name, path = re.fullmatch(r"https://colab[^/]*/github/(\w+)/(\w+)/blob/main/(.*)", link).groups()
        assert f"https://host/{owner}/{name}" == ADDRESS
        assert (ROOT / path).exists()
