"""What touch is worth: forces of the pegs and hidden senses of real runs, tables of made-up entries."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("scipy")

from experiments import touch
from snake_env.evaluation import evaluate
from training.submission.entry import Run, Scores, Submission


def entry(*rates):
    """With a run for each success rate."""
    runs = [
        Scores(
            success=rate,
            speed=0.1 * rate,
            speed_deviation=0.0,
            score=0.0,
            cost_of_transport=None,
            contact_free=0.5,
            chatter=0.1,
            failed=0,
        )
        for rate in rates
    ]
    return Submission(
        about="",
        robot_class="aiko",
        track="map",
        blocks=(),
        episodes=4,
        versions={},
        runs=tuple(Run(policy="gait", scores={"field-hard": one}) for one in runs),
    )


def test_a_run_is_measured_over_the_steps_of_its_episodes(tmp_path):
    found = touch.measure("general", 3, 1)
    assert found.success == evaluate("general", "field-hard", robot_class="aiko", scenes=3).scores["success"].value
    assert found.push_points.sum() == pytest.approx(1.0)
    assert found.ahead.max() > 0.1 > 0.0 >= found.back.max()
    blind = touch.measure("general", 3, 1, ("pegs", "link_pegs"))
    assert not np.allclose(blind.ahead, found.ahead)
    entries = dict.fromkeys(touch.TRACKS, entry(0.4, 0.6))
    assert touch.draw(entries, {track: [found, blind] for track in touch.TRACKS}, tmp_path / "touch.png").stat().st_size


def test_tables_are_over_runs():
    entries = dict.fromkeys(touch.TRACKS, entry(0.5, 0.6, 0.7)) | {"map": entry(0.8, 0.9, 1.0)}
    rows = touch.scores(entries).splitlines()
    assert rows[2].startswith("| map | 3 | 0.900 [0.652, 1.000] |"), "Student's interval"
    first, second, _ = touch.differences(entries)
    assert first == "map against range: field-hard +0.300 [+0.073, +0.527]"
    assert second.startswith("range against touch: field-hard +0.000 [-0.2")
    entries["range"] = entry(0.5)
    assert touch.differences(entries)[0] == "map against range: field-hard +0.400", "one run has no interval"
    assert touch.scores(entries).splitlines()[3].startswith("| range | 1 | 0.500 |")
