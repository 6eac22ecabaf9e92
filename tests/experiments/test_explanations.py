"""What explains how Aiko moved, as the page has it."""

from __future__ import annotations

from pathlib import Path

from conftest import check_rows

from experiments import explanations


def test_the_command_prints_the_table_of_the_page(capsys):
    assert explanations.main([]) == 0
    page = Path(__file__).parents[2] / "docs/robot.md"
    check_rows(capsys.readouterr().out, page.read_text(encoding="utf-8"))


def test_joints_that_give_way_turn_the_robot_and_motors_do_not():
    """As the page concludes; friction neither."""
    turns = {name: explanations.measured(**explanations.CHANGES[name])[2][1] for name in explanations.CHANGES}
    to_the_right = {name for name, turn in turns.items() if turn > 5.0}
    assert to_the_right == {"backlash of 4 degrees", "k_P = 15 N m/rad"}
