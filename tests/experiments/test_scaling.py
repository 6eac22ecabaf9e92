"""What many cores would give, put together from measured parts."""

import dataclasses

import pytest

pytest.importorskip("torch")

from experiments import scaling
from training import config

PARTS = scaling.Parts(collect=20e-6, learn=30e-6, hand_over=1e-6, record=0.0, weights=1e5, gradients=40, steps=8192)


def test_one_core_collects_and_learns_in_turn():
    assert PARTS.one_learner(1) == pytest.approx(1.0 / 50e-6)
    assert PARTS.equal_workers(1) == pytest.approx(1.0 / 50e-6)


def test_one_learner_bounds_any_number_of_actors():
    bound = 1.0 / 31e-6
    assert 0.99 * bound < PARTS.one_learner(10_000) < bound


def test_a_ring_costs_what_its_bytes_take():
    rate = PARTS.equal_workers(1000) / 1000
    seconds = 8192 * 50e-6 + 40 * 2e5 / scaling.NETWORK
    assert rate == pytest.approx(8192 / seconds)


def test_the_section_of_a_page_is_replaced(tmp_path, capsys):
    page = tmp_path / "scaling.md"
    page.write_text("# Scaling\n\nKept.\n\n## What many cores would give\n\nOld.\n")
    smoke = tmp_path / "smoke.json"
    config.save(dataclasses.replace(config.load("smoke"), num_envs=4), smoke)
    assert scaling.main(["--config", str(smoke), "--write", str(page)]) == 0
    assert "Kept." in page.read_text()
    assert "Old." not in page.read_text()
    assert page.read_text().endswith(capsys.readouterr().out.removesuffix("\n"))
