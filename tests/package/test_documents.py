"""The snippets of the pages run as they stand, one after another as a reader would type them."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = "README.md"
DOCS = sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("docs/**/*.md"))
PAGES = [README, "CHANGELOG.md", "CONTRIBUTING.md", *DOCS]
SHORTER = {"learn(500_000)": "learn(4_096)"}
"""What would take minutes."""
ROUNDED_BY_THE_PROCESSOR = (README, "docs/notes/learning.md")
"""Pages with learning or long runs of a policy, whose later lines differ in their last digit between processors:
products of NumPy and torch round differently, and contacts amplify it."""


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def snippets(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", list(filter(snippets, PAGES)))
def test_snippets_run_and_print_what_the_page_says(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if page == README:
        pytest.importorskip("stable_baselines3")
    names = {"__name__": "__main__"}
    for block in snippets(page):
        for long, short in SHORTER.items():
            block = block.replace(long, short)
        exec(compile(block, page, "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    text = text_of(page)
    for line in printed[:1] if page in ROUNDED_BY_THE_PROCESSOR else printed:
        assert line in text


@pytest.mark.parametrize("page", PAGES)
def test_links_between_pages_lead_somewhere(page):
    for target, section in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", text_of(page)):
        if "://" in target:
            continue
        path = (ROOT / page).parent / target if target else ROOT / page
        assert path.exists(), target
        if section:
            assert section in sections(path.read_text(encoding="utf-8")), f"{target}#{section}"


def sections(text: str) -> list[str]:
    """Names by which the headings of a page are linked."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings]


@pytest.mark.parametrize("page", PAGES)
def test_commands_and_names_on_a_page_exist(page):
    """Modules after ``python -m``, targets after ``make``, and long names such as those of tests."""
    text = text_of(page)
    for module in set(re.findall(r"python -m\s+([\w.]+)", text)):
        path = ROOT.joinpath(*module.split("."))
        assert path.with_suffix(".py").exists() or (path / "__main__.py").exists(), module
    targets = set(re.findall(r"^([\w-]+):", text_of("Makefile"), re.MULTILINE))
    assert set(re.findall(r"`make (\w[\w-]*)", text)) <= targets
    for name in set(re.findall(r"`((?:[a-z0-9]+_){3,}[a-z0-9]+)`", text)):
        assert name in sources(), name


@cache
def sources() -> str:
    """All of the code."""
    folders = ("rust", "snake_env", "training", "experiments", "benchmarks", "tests")
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.*") if file.suffix in {".rs", ".py"}]
    return "\n".join(file.read_text(encoding="utf-8") for file in files)
