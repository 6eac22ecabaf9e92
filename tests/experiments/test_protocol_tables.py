from __future__ import annotations

from experiments import protocol_tables


def test_the_page_has_the_tables_that_follow_from_the_data():
    page = protocol_tables.PAGE.read_text()
    assert protocol_tables.written(page) == page
