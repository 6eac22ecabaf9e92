"""Hook of mkdocs: the README with the playground is the home page, links out of docs/ become plain text, and Sphinx
roles of docstrings links. Pages that are notebooks, too, have a link that opens them in Colab. ``llms.txt`` lists the
pages of the menu for programs that read them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

PLAYGROUND = """
<iframe src="playground/index.html" title="Playground: the simulator in this page" loading="lazy"
  style="width: 100%; height: 34rem; border: 1px solid #8884; border-radius: 8px"></iframe>

The simulator itself runs in the frame above ([full page](playground/index.html){target=_blank}): drag pegs, pull the
robot, change gait, friction and number of links, in the plane and in 3D; or watch a shipped policy.
"""
COLAB = "https://colab.research.google.com/github"
ROLE = re.compile(r":(?:attr|class|data|exc|func|meth|mod):<code>([^<]*)</code>")
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(((?![a-z]+://)[^)#\s]*)(#[^)]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    """Adds the home page; the playground is left out where it has not been built (`make playground`)."""
    readme = Path(config["config_file_path"]).with_name("README.md").read_text(encoding="utf-8")
    home = readme.replace("](docs/", "](")
    if files.get_file_from_path("playground/index.html"):
        claim, film, rest = home.partition("\n![")
        home = claim + PLAYGROUND + film + rest
    files.append(File.generated(config, "index.md", content=home))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Keeps the words of links that lead out of the site."""
    folder = Path(page.file.src_uri).parent

    def kept(found: re.Match[str]) -> str:
        words, target, _ = found.groups()
        return found[0] if not target or files.get_file_from_path(_joined(folder, target)) else words

    return LINK.sub(kept, markdown)


def on_page_content(html: str, page: Any, config: Any, files: Files) -> str:
    """Roles of docstrings, such as ``:class:`Scene```, become names, with a link where the page describes them."""
    described = [(one.start(), one[1]) for one in re.finditer(r'id="(snake_env[\w.]*)"', html)]

    def named(found: re.Match[str]) -> str:
        name = found[1].removeprefix("~")
        here = max((one for one in described if one[0] < found.start()), default=(0, ""))[1]
        targets = [one for _, one in described if f".{one}".endswith(f".{name}")]
        # The one of the same class, if there are several.
        target = max(targets, key=lambda one: here.startswith(one.removesuffix(name)), default=None)
        return f'<a href="#{target}"><code>{name}</code></a>' if target else f"<code>{name}</code>"

    return _opens_in_colab(page, config) + ROLE.sub(named, html)


def _opens_in_colab(page: Any, config: Any) -> str:
    """A link, where the page is a notebook of `python -m experiments.notebooks` and the repository has an address."""
    source = Path(page.file.src_uri)
    if source.parent.name not in ("", "tutorials"):
        return ""
    notebook = f"docs/notebooks/{source.stem}.ipynb"
    if not config["repo_url"] or not (Path(config["config_file_path"]).parent / notebook).exists():
        return ""
    owner_and_name = "/".join(config["repo_url"].rstrip("/").split("/")[-2:])
    return f'<p><a href="{COLAB}/{owner_and_name}/blob/main/{notebook}">Open in Colab</a></p>'


def on_nav(nav: Any, config: Any, files: Files) -> Any:
    """Notes the pages of the menu."""
    _MENU[:] = nav.pages
    return nav


def on_post_build(config: Any) -> None:
    """Lists them with the words that each begins with."""
    lines = [f"# {config['site_name']}", "", f"> {config['site_description']}", "", "## Pages", ""]
    lines += [f"- [{one.title}]({one.file.dest_uri}): {_beginning(one.markdown or '')}" for one in _MENU]
    Path(config["site_dir"], "llms.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


_MENU: list[Any] = []


def _beginning(markdown: str) -> str:
    """The first paragraph that is text."""
    prose = re.sub(r"^```.*?^```$", "", markdown, flags=re.MULTILINE | re.DOTALL)
    text = (one for one in prose.split("\n\n") if not one.lstrip("\n").startswith(("#", "    ", "!", "<")))
    paragraphs = (" ".join(one.split()) for one in text)
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", next(filter(None, paragraphs), ""))


def _joined(folder: Path, target: str) -> str:
    parts: list[str] = []
    for part in (folder / target).parts:
        if part == ".." and parts:
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)
