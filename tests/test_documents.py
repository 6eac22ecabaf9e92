"""The snippets of the pages run as they stand, one after another as a reader would type them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = "README.md"
PAGES = [README, "docs/simulate.md", "docs/chapter-4.md", "docs/chapter-6.md"]
SHORTER = {"learn(500_000)": "learn(4_096)"}
"""What would take minutes."""


def snippets(page: str) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES)
def test_snippets_run_and_print_what_the_page_says(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if page == README:
        pytest.importorskip("stable_baselines3")
    names = {"__name__": "__main__"}
    blocks = snippets(page)
    assert blocks
    for block in blocks:
        for long, short in SHORTER.items():
            block = block.replace(long, short)
        exec(compile(block, page, "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    text = (ROOT / page).read_text(encoding="utf-8")
    for line in printed[:1] if page == README else printed:
        assert line in text


@pytest.mark.parametrize("page", [README, *sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("docs/*.md"))])
def test_links_between_pages_lead_somewhere(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert ((ROOT / page).parent / target).exists(), target
