"""The measured cost of a training step."""

import pytest

pytest.importorskip("torch")

from experiments import scaling
from training import config


def test_the_section_of_a_page_is_replaced(tmp_path, capsys):
    page = tmp_path / "scaling.md"
    page.write_text(f"# Scaling\n\nKept.\n\n{scaling.HEADING}\n\nOld.\n")
    smoke = tmp_path / "smoke.json"
    config.save(config.load("smoke").with_changes(num_envs=4), smoke)
    assert scaling.main(["--config", str(smoke), "--write", str(page)]) == 0
    assert "Kept." in page.read_text()
    assert "Old." not in page.read_text()
    assert page.read_text().endswith(capsys.readouterr().out.removesuffix("\n"))


def test_the_ratio_of_collecting_and_learning_is_stated():
    parts = scaling.Parts(collect=20e-6, learn=40e-6, hand_over=1e-6, record=100.0, weights=1e5, gradients=40)
    assert "busy with 0.5 collecting cores" in scaling.page(parts, "field-hard")
