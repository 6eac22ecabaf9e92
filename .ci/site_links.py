"""Hook of mkdocs: the README is the home page, and links to files outside of docs/ become plain text."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(((?![a-z]+://)[^)#\s]*)(#[^)]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    """Adds the home page."""
    readme = Path(config["config_file_path"]).with_name("README.md").read_text(encoding="utf-8")
    files.append(File.generated(config, "index.md", content=readme.replace("](docs/", "](")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Keeps the words of links that lead out of the site."""
    folder = Path(page.file.src_uri).parent

    def kept(found: re.Match[str]) -> str:
        words, target, _ = found.groups()
        return found[0] if not target or files.get_file_from_path(_joined(folder, target)) else words

    return LINK.sub(kept, markdown)


def _joined(folder: Path, target: str) -> str:
    parts: list[str] = []
    for part in (folder / target).parts:
        if part == ".." and parts:
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)
