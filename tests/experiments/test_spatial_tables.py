"""The command behind the tables of docs/spatial-method.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from conftest import check_rows

from experiments import spatial_tables

PAGE = Path(__file__).parents[2] / "docs/spatial-method.md"


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_it_prints_the_tables_of_the_page(monkeypatch, capsys):
    """One row of each table; rates depend on the machine."""
    monkeypatch.setattr(spatial_tables, "STEPS", (0.025,))
    monkeypatch.setattr(spatial_tables, "FRICTION", ((0.2, 0.2),))
    assert spatial_tables.main([]) == 0
    for table in capsys.readouterr().out.strip().split("\n\n"):
        check_rows(without_rates(table), without_rates(PAGE.read_text(encoding="utf-8")))


def without_rates(text: str) -> str:
    """Solves stay."""
    return re.sub(r"(\| [\d,]+), \d+ \|", r"\1 |", text)
