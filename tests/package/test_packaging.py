"""What makes the package pleasant to install: light imports, types, generated pages that are up to date."""

from __future__ import annotations

import importlib.util
import inspect
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from conftest import run_python

import snake_env
from snake_env import _native, card
from snake_env.__main__ import COMMANDS, main
from snake_env._cli import WIDTH
from snake_env.commands import environment_pages

ROOT = Path(__file__).parents[2]
STUB = (ROOT / "snake_env/_native.pyi").read_text(encoding="utf-8")
FUNCTIONS = sorted(name for name, value in vars(_native).items() if inspect.isbuiltin(value))


def test_import_is_light():
    """What the package adds to numpy and gymnasium: some forty modules of its own, and none that draws or learns."""
    code = """
        import sys
        import numpy, gymnasium, gymnasium.vector
        before = set(sys.modules)
        import snake_env
        added = {name.partition(".")[0] for name in set(sys.modules) - before}
        own = [name for name in sys.modules if name.startswith("snake_env")]
        print(len(own), *sorted(added - set(sys.stdlib_module_names)))
    """
    count, *packages = run_python(code).split()
    assert packages == ["snake_env"]
    assert int(count) <= 45


def test_the_environment_pages_are_up_to_date():
    page = (ROOT / "docs/environments.md").read_text(encoding="utf-8")
    assert page == card.page(), "run `make docs`"
    written = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs/environments").glob("*.md")}
    assert written == environment_pages.pages(), "run `make docs`"


def test_the_page_of_an_id_is_short_and_has_a_film():
    for name, page in environment_pages.pages().items():
        assert len(page.splitlines()) <= 150, name
        film = ROOT / f"docs/images/env-{Path(name).stem}.gif"
        assert 10_000 < film.stat().st_size < 3_000_000, film.name


def test_the_page_lists_every_argument_of_every_environment():
    config = _native.layout({"task": "field"})["config"]
    assert set(card.ARGUMENTS) == set(config)
    assert set(snake_env.options.TaskOptions.__annotations__) == set(config) - {"max_episode_steps"} | set(card.WORLD)


def module_of_ci(name):
    """A script of the folder .ci, which is no package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / f".ci/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_release_has_one_version_and_one_date():
    release = module_of_ci("release_version")
    assert set(release.found(release.WHERE).values()) == {snake_env.__version__}
    assert len(set(release.found(release.DATES).values())) == 1
    release.main(f"v{snake_env.__version__}")
    with pytest.raises(SystemExit, match="must agree"):
        release.main("v99.0.0")


def test_a_release_has_no_relative_links():
    """Package indexes show the README alone."""
    absolute_links = module_of_ci("absolute_links")
    text = absolute_links.absolute((ROOT / "README.md").read_text(encoding="utf-8"), "https://host/me/snake", "v9")
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert all(target.startswith("https://") for target in targets)
    assert "](https://host/me/snake/raw/v9/docs/images/env-field.gif)" in text
    own = re.findall(r"\]\(https://host/me/snake/(?:raw|blob)/v9/([^)#]*)", text)
    assert len(own) > 20
    assert all((ROOT / target).exists() for target in own)
    assert 'Issues = "https://host/me/snake/issues"' in absolute_links.urls("https://host/me/snake", "v9")


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_the_page_lists_every_info_of_a_model_once(model):
    page = card.page()
    infos, rewards = (page.partition(f"## {name}\n")[2].partition("\n## ")[0] for name in ("Info", "Rewards"))
    others = {"planar", "spatial"} - {model}
    for signal in card.layout_of(model=model)["signals"]:
        term = signal["name"].removeprefix("reward_")
        row = rf"^\| `{term}` \|(.*)$" if term == signal["name"] else rf"^\| {term} \|(.*)$"
        (found,) = re.findall(row, infos if term == signal["name"] else rewards, re.MULTILINE)
        assert not any(f"({other})" in found for other in others), signal["name"]


@pytest.mark.parametrize("command", [[], ["card"], ["--help"]])
def test_the_command_line_answers(command):
    result = subprocess.run([sys.executable, "-m", "snake_env", *command], capture_output=True, text=True, check=False)
    assert result.returncode == 0
    assert ("SnakeField-v1" if command == ["card"] else "snake-env view --policy general") in result.stdout
    assert command == ["card"] or max(map(len, result.stdout.splitlines())) <= 100


@pytest.mark.parametrize("command", [*COMMANDS, "card general"])
def test_what_a_command_says_of_itself_fits_a_terminal(command, capsys):
    name, *arguments = command.split()
    with suppress(SystemExit):
        main([name, *(arguments or ["--help"])])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 5
    assert max(map(len, lines)) <= WIDTH


def test_the_command_line_says_its_version(capsys):
    with pytest.raises(SystemExit) as left:
        main(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"snake-env {snake_env.__version__}\n"


def test_the_stub_lists_what_the_extension_has():
    assert sorted(re.findall(r"^def (\w+)", STUB, re.MULTILINE)) == FUNCTIONS
    methods = {name for name in vars(_native.Batch) if not name.startswith("__")}
    assert methods == set(re.findall(r"^    def ([a-z]\w+)", STUB.partition("class Batch")[2], re.MULTILINE))
    assert (ROOT / "snake_env/py.typed").exists()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_stub_has_the_extensions_parameters(name):
    signature = re.search(rf"^def {name}\((.*?)\)", STUB, re.MULTILINE | re.DOTALL)[1]
    parameters = [part.split(":")[0].strip() for part in signature.split(",") if part.strip()]
    assert parameters == list(inspect.signature(getattr(_native, name)).parameters)


def test_constraints_pin_versions_and_nothing_else():
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        assert re.fullmatch(r"[a-z0-9-]+==[0-9a-z.]+( ; .+)?", line), line


def test_workflows_pin_what_they_use_by_commit_and_say_its_version():
    lines = [
        line
        for workflow in (ROOT / ".github/workflows").glob("*.yml")
        for line in workflow.read_text(encoding="utf-8").splitlines()
        if "uses:" in line
    ]
    assert len(lines) > 10
    for line in lines:
        assert re.fullmatch(r" *- uses: [\w/-]+@[0-9a-f]{40} # v[\d.]+", line), line
