"""The command behind the tables of docs/spatial-method.md."""

from __future__ import annotations

import re
from pathlib import Path

from experiments import spatial_tables
from snake_env import Gait

PAGE = Path(__file__).parents[2] / "docs/spatial-method.md"


def test_it_prints_the_tables_of_the_page(monkeypatch, capsys):
    """With few and short runs; heads and first columns must be those of the page."""
    monkeypatch.setattr(spatial_tables, "DURATION", 0.3)
    monkeypatch.setattr(spatial_tables, "FINE", 0.005)
    monkeypatch.setattr(spatial_tables, "GAITS", (Gait(),))
    assert spatial_tables.main([]) == 0
    printed = capsys.readouterr().out
    page = PAGE.read_text(encoding="utf-8")
    for table in printed.strip().split("\n\n"):
        head, _, *rows = table.splitlines()
        assert head in page
        for row in rows:
            assert re.search(rf"^{re.escape(row[: row.index('|', 1)])}\|", page, re.MULTILINE), row
