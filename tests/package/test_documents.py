"""The snippets of the pages run as they stand, in a fresh process: those of the README each alone, those of other pages
one after another as a reader would type them. Numbers that pages repeat are those of their source."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from pkgutil import resolve_name

import pytest
from conftest import run_python

from snake_env.policies import NAMES, load_policy

ROOT = Path(__file__).parents[2]
README = "README.md"
DOCS = sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("docs/**/*.md"))
PAGES = [README, "CHANGELOG.md", "CONTRIBUTING.md", *DOCS]
SHORTER = {"learn(500_000)": "learn(4_096)", "view(model, venv).wait()": "view(model, venv).stop()"}
"""What would take minutes."""
ROUNDED_BY_THE_PROCESSOR = (README,)
"""Pages with learning or long runs of a policy, whose later lines differ in their last digit between processors:
products of NumPy and torch round differently, and contacts amplify it."""


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def snippets(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)


def programs() -> list[tuple[str, str]]:
    """Page and code of every process that a reader starts."""
    readme = [(README, block) for block in snippets(README)]
    return readme + [(page, "\n".join(snippets(page))) for page in PAGES[1:] if snippets(page)]


@pytest.mark.parametrize(("page", "code"), programs(), ids=[page for page, _ in programs()])
def test_snippets_run_and_print_what_the_page_says(page, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for module, name in {"stable_baselines3": "stable_baselines3", "mujoco": "from_mjcf"}.items():
        if name in code:
            pytest.importorskip(module)
    for long, short in SHORTER.items():
        code = code.replace(long, short)
    printed = [line for line in run_python(code, timeout=300).splitlines() if not line.startswith("http://")]
    text = text_of(page)
    for line in printed[:1] if page in ROUNDED_BY_THE_PROCESSOR else printed:
        assert line in text


ESTIMATE = r"\d\.\d{3} \[\d\.\d{3}, \d\.\d{3}\]"


@pytest.mark.parametrize(("page", "section"), [(README, "Learned results"), ("docs/results.md", "Shipped policies")])
def test_scores_on_a_page_are_those_of_the_policies_cards(page, section):
    text = text_of(page).partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    rows = re.findall(rf"^\| `({'|'.join(NAMES)})` \|(.*)$", text, re.MULTILINE)
    assert len(rows) >= 5
    for name, row in rows:
        scored = load_policy(name).card.scores
        known = {"{:.3f} [{:.3f}, {:.3f}]".format(*scored[score]) for score in ("success", "speed")}
        assert set(re.findall(ESTIMATE, row)) <= known, name


def test_the_readme_quotes_the_leaderboard():
    entries = [json.loads(path.read_text(encoding="utf-8")) for path in ROOT.glob("submissions/*/entry.json")]
    scripted = [one["runs"][0] for one in entries if one["robot_class"] == "ideal" and one["runs"][0]["steps"] == 0]
    known = [
        max(run["scores"][task]["success"] for run in scripted if task in run["scores"])
        for task in ("field-hard", "corridor", "perturbed")
    ]
    sentence = r"scripted\s+controllers\s+reach ([\d.]+) in hard\s+fields, ([\d.]+) in corridors and ([\d.]+) on"
    found = re.search(sentence, text_of(README))
    assert list(found.groups()) == [f"{value:.3f}" for value in known]
    as_aiko = json.loads(text_of("submissions/aiko-general/entry.json"))["runs"][0]["scores"]["field-hard"]["success"]
    assert f"`general` reaches {as_aiko:.3f}" in text_of(README)


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
    """Modules after ``python -m``, targets after ``make``, and long names such as those of tests.

    Those of a released version are of its time.
    """
    text = text_of(page) if page != "CHANGELOG.md" else text_of(page).partition("\n## [0")[0]
    for module in set(re.findall(r"python -m\s+([\w.]+)", text)):
        path = ROOT.joinpath(*module.split("."))
        assert path.with_suffix(".py").exists() or (path / "__main__.py").exists(), module
    targets = set(re.findall(r"^([\w-]+):", text_of("Makefile"), re.MULTILINE))
    assert set(re.findall(r"`make (\w[\w-]*)", text)) <= targets
    for name in set(re.findall(r"`((?:[a-z0-9]+_){3,}[a-z0-9]+)`", text)):
        assert name in sources(), name


NAV = re.findall(r"([\w/-]+\.(?:md|py))$", text_of("mkdocs.yml").partition("\nnav:")[2], re.MULTILINE)
MENU = [page for page in NAV if page not in ("index.md", "tutorials/spatial.py")]
LONGEST_SENTENCE = 25
"""In words; lists of cells, whose items semicolons part, have as many sentences as items."""


def test_the_menu_has_few_pages():
    assert len(NAV) <= 28


def paragraphs(text: str) -> Iterator[str]:
    """Prose and cells of a page, and of each item of a list."""
    text = re.sub(r"^```.*?^```$|<!--.*?-->", "\n\n", text, flags=re.MULTILINE | re.DOTALL)
    yield from (
        part
        for line in re.findall(r"^\|.*", text, re.MULTILINE)
        for cell in line.split("|")
        for part in cell.split(";")
    )
    text = re.sub(r"^(?:\||#|!|:::| {4}).*$", "", text, flags=re.MULTILINE)
    yield from re.split(r"\n\s*\n|^\s*(?:[*-]|\d+\.) ", text, flags=re.MULTILINE)


def docstrings() -> Iterator[str]:
    """What the API reference is generated from."""
    for extra in ("rsl_rl", "stable_baselines3"):
        pytest.importorskip(extra)
    for name in re.findall(r"^::: (snake_env\S+)", text_of("docs/api.md"), re.MULTILINE):
        for one in with_members(resolve_name(name)):
            # Each field or argument on its own.
            yield from re.split(r"\n\s*\n|^ *\**\w+: ", inspect.getdoc(one) or "", flags=re.MULTILINE)


def with_members(thing: object) -> Iterator[object]:
    """A function, class or module, and the public ones inside."""
    yield thing
    for name, value in vars(thing).items() if inspect.isclass(thing) or inspect.ismodule(thing) else ():
        value = getattr(value, "__func__", value)
        own = not inspect.ismodule(thing) or getattr(value, "__module__", None) == thing.__name__
        if own and not name.startswith("_") and (callable(value) or isinstance(value, property)):
            yield from with_members(value)


@pytest.mark.parametrize("page", [README, *(f"docs/{page}" for page in MENU), "docstrings"])
def test_sentences_for_users_are_short(page):
    for paragraph in docstrings() if page == "docstrings" else paragraphs(text_of(page)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`+[^`]*`+", "CODE", " ".join(paragraph.split())))
        for sentence in re.split(r"(?<=[.!?])\**\)?\s+(?=[^a-z])", words):
            assert len(sentence.split()) <= LONGEST_SENTENCE, sentence


@pytest.mark.parametrize("page", MENU)
def test_a_page_for_users_begins_with_what_runs(page):
    """A snippet or a command, before anything that takes a screen of text; the first page is the README."""
    before = re.split(r"^(?:```python| {4}\S)", text_of(f"docs/{page}"), maxsplit=1, flags=re.MULTILINE)
    assert len(before) == 2, "no snippet"
    assert len(before[0].split()) < 130


@cache
def sources() -> str:
    """All of the code."""
    folders = ("rust", "snake_env", "training", "experiments", "benchmarks", "tests")
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.*") if file.suffix in {".rs", ".py"}]
    return "\n".join(file.read_text(encoding="utf-8") for file in files)
