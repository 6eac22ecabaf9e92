"""The table of findings: every row holds, by both methods, and the command writes what it says."""

import ast
import dataclasses
import json
import re
from collections import Counter, defaultdict
from pathlib import Path

import pytest

from snake_env.__main__ import main
from snake_env.reproduce import checks, report
from snake_env.reproduce.checks import CHECKS, control, sidewinding
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import SECTIONS, Finding, Rows, Verdict

ROOT = Path(__file__).parents[2]
QUOTED = {
    "sidewinding: where it goes": r"(\d+), (\d+) and (\d+) degrees. Once per period",
    "sidewinding on (0.01, 1): slides back": r"slides back by up to ([\d.]+), ([\d.]+) and ([\d.]+) cm",
    "Table 7.3 in 3D": r"([\d.]+) and ([\d.]+) cm/s, paths within (\d+) mm",
}
"""Rows whose numbers docs/reproduction.md repeats in other words."""
ROW = Finding("7.5.3", "speed", Verdict.REPRODUCED, "15 cm/s", "3 cm/s | wrong", "14 to 16 cm/s", "", "", False)


def test_every_row_holds_with_the_default_integrator(tmp_path, capsys):
    assert main(["reproduce", "--quick", "--out", str(tmp_path)]) == 0
    rows = json.loads((tmp_path / "findings.json").read_text())
    assert [row["name"] for row in rows] == [check.name for check in CHECKS]
    assert all(row["holds"] for row in rows)
    printed = capsys.readouterr().out
    assert "FAIL" not in printed
    counts = Counter(row["verdict"] for row in rows)
    summary = f"{len(rows)} findings: " + ", ".join(f"{counts[verdict.value]} {verdict.value}" for verdict in Verdict)
    assert summary in printed
    assert summary in (tmp_path / "findings.md").read_text()
    page = (ROOT / "docs/reproduction.md").read_text(encoding="utf-8")
    for name, pattern in QUOTED.items():
        quoted = re.search(pattern, page)
        ours = next(row["ours"] for row in rows if row["name"] == name)
        assert set(quoted.groups()) <= set(re.findall(r"\d+(?:\.\d+)?", ours)), f"{quoted[0]}: {ours}"


@pytest.mark.parametrize("section", ["2.3.2", "7.3.1", "7.3.4", "7.5.2"])
def test_rows_hold_as_printed_too(section, tmp_path):
    """One section per kind: impacts in 3D, small pegs in both models, open ground."""
    assert main(["reproduce", "--method", "thesis", "--section", section, "--quick", "--out", str(tmp_path)]) == 0


def test_every_section_has_rows_and_every_row_says_what_it_demands():
    assert {check.section for check in CHECKS} == set(SECTIONS)
    assert len({(check.section, check.name) for check in CHECKS}) == len(CHECKS)
    for check in CHECKS:
        assert check.bound, check.name
        assert bool(check.thesis) == (check.verdict != Verdict.OURS), check.name
        assert bool(check.reason) == (check.verdict == Verdict.CORRECTED), check.name


def test_no_row_holds_whatever_comes_out():
    """What a check returns beside its words is measured; a constant cannot fail."""
    for path in Path(checks.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
                assert not isinstance(node.value.elts[-1], ast.Constant), f"{path.name}, line {node.lineno}"


def test_a_slow_controller_does_not_pass(monkeypatch):
    monkeypatch.setattr(control, "_seconds", lambda runs, name: 30.0 if name == "IO, set-valued" else 1.0)
    row = next(check for check in CHECKS if check.name == "time of simulation under IO")
    assert not row.finding(Runs({})).holds


@pytest.mark.parametrize(
    ("found", "holds"),
    [((93.0, 94.0, 82.0, 86.0), True), ((93.0, 94.0, 86.5, 85.0), False), ((93.0, 94.0, 82.0, 70.0), False)],
)
def test_directions_differ_by_more_than_tolerances_explain(found, holds, monkeypatch):
    """6.7 deg in the independent implementation, whose tolerance is the printed one too."""
    directions = iter(found)
    monkeypatch.setattr(sidewinding, "displacement", lambda *_: None)
    monkeypatch.setattr(sidewinding, "direction", lambda _: next(directions))
    row = next(check for check in CHECKS if check.name == "sidewinding: where it goes")
    assert row.finding(defaultdict(lambda: None)).holds == holds


def test_the_page_counts_the_verdicts():
    counts = Counter(check.verdict for check in CHECKS)
    page = (ROOT / "docs/reproduction.md").read_text(encoding="utf-8")
    sentence = re.search(r"Of \d+ findings, [^.]*\.", page)
    assert sentence, "a sentence that begins with `Of 64 findings,`"
    assert [int(number) for number in re.findall(r"\d+", sentence[0])] == [len(CHECKS), *map(counts.get, Verdict)]


def test_figures_of_other_implementations_are_not_the_thesis_s():
    """They stand in the same column, marked and with their source."""
    independent = [check for check in CHECKS if check.independent]
    assert len(independent) >= 6
    assert all("another implementation of chapter" in check.independent for check in independent)
    row = dataclasses.replace(ROW, thesis="", independent="0.35 deg; another implementation of chapter 6")
    assert "(no such statement) [independent: 0.35 deg; another" in report.markdown([row])


def test_sections_can_be_chosen_and_give_their_figures(tmp_path):
    assert main(["reproduce", "--section", "7.5.2", "--out", str(tmp_path)]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"figure-7.14.png", "findings.json", "findings.md"}
    assert (tmp_path / "figure-7.14.png").stat().st_size > 10_000


def test_unknown_sections_are_refused(tmp_path):
    with pytest.raises(SystemExit):
        main(["reproduce", "--section", "6.1", "--out", str(tmp_path)])


def test_a_row_that_does_not_hold_is_shown_and_counted():
    assert report.printed([ROW]).splitlines()[2].startswith("FAIL")
    assert "3 cm/s \\| wrong" in report.markdown([ROW])
    assert report.summary([ROW]).endswith("0 reproduced, 0 refuted or refined, 0 ours, 1 FAILED.")


def test_a_command_whose_rows_do_not_hold_ends_with_status_1(tmp_path, monkeypatch):
    rows = Rows("7.5.2")
    rows.ours("never", bound="none")(lambda runs: ("nothing", False))
    monkeypatch.setattr("snake_env.reproduce.command.CHECKS", rows.checks)
    assert main(["reproduce", "--section", "7.5.2", "--quick", "--out", str(tmp_path)]) == 1
