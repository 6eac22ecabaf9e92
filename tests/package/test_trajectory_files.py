"""Runs as tables and files."""

from __future__ import annotations

import dataclasses
import json
import pickle

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Robot, Scene

RECORD = ("velocity", "ground", "obstacles", "self_contacts", "power")
RUNS = {
    "planar": {"robot": Robot(links=5, joint_limit=None), "record": RECORD},
    "spatial": {"record": RECORD, "self_contact": True},
    "minimal": {},
    "without obstacles": {"model": "planar", "scene": Scene(), "record": "obstacles"},
}


def run(name):
    scene = Scene(obstacles=[(0.1, 2.0, 2.0), snake_env.obstacles.Circle(0.1, 3.0, 3.0, friction=0.2)])
    given = {} if name == "minimal" else {"scene": scene}
    return snake_env.simulate(**({"model": name} | given | {"duration": 0.3, "sample": 0.05} | RUNS[name]))


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("ending", ["npz", "csv", "parquet"])
def test_a_run_comes_back_as_it_was(tmp_path, name, ending):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    before = run(name)
    after = snake_env.load_trajectory(before.save(tmp_path / f"run.{ending}"))
    for field in dataclasses.fields(before):
        one, other = getattr(before, field.name), getattr(after, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(other, one)
            assert other.flags.c_contiguous
        else:
            assert other == one, field.name


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_tables_have_a_column_for_each_number(tmp_path, ending):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    made = run("spatial")
    path = made.save(tmp_path / f"run.{ending}")
    for frame in (made.to_dataframe(), pandas.read_csv(path) if ending == "csv" else pandas.read_parquet(path)):
        assert len(frame) == len(made.time)
        np.testing.assert_allclose(frame["time"], made.time)
        np.testing.assert_allclose(frame["position_3_z"], made.position[:, 2, 2])
        np.testing.assert_allclose(frame["quaternion_1_w"], made.quaternion[:, 0, 0])
        np.testing.assert_allclose(frame["joint_angle_2_pitch"], made.joint_angle[:, 1, 1])
        np.testing.assert_allclose(frame["pair_force_2_1_y"], made.pair_force[:, 1, 0, 1])
        np.testing.assert_allclose(frame["ground_normal_1_2"], made.ground_normal[:, 0, 1])
    assert made.to_dataframe().attrs["robot"]["links"] == 11
    assert [*run("planar").to_dataframe()][-1].startswith("friction_power")
    assert "joint_angle_4" in run("planar").to_dataframe()


class Trap:
    """Leaves a file where it is unpickled."""

    def __reduce__(self):
        return print, ("it ran",)


def test_files_of_others_run_nothing_and_are_refused(tmp_path, capsys):
    path = run("planar").save(tmp_path / "run.npz")
    with np.load(path) as archive:
        found = dict(archive)
    np.savez(path, **found | {"angle": np.array([Trap()], object)})
    with pytest.raises(ConfigError, match=r"^path = .*: expected a file that Trajectory\.save has written"):
        snake_env.load_trajectory(path)
    assert pickle.loads(pickle.dumps(Trap())) is None
    assert capsys.readouterr().out == "it ran\n", "the trap, here only"


@pytest.mark.parametrize(
    "change",
    [
        {"format": "another"},
        {"shapes": 3},
        {"shapes": {"time": [10**9, 10**9]}},
        {"shapes": {"time": [], "angle": [3]}},
        {"surplus": 1},
        {"robot": {"links": 1}},
    ],
)
def test_files_with_wrong_parts_are_refused(tmp_path, change):
    path = run("planar").save(tmp_path / "run.csv")
    beside = tmp_path / "run.json"
    beside.write_text(json.dumps(json.loads(beside.read_text()) | change))
    with pytest.raises(ConfigError):
        snake_env.load_trajectory(path)
    beside.unlink()
    with pytest.raises(ConfigError, match=r"^path = "):
        snake_env.load_trajectory(path)


def test_a_run_has_a_known_ending(tmp_path):
    with pytest.raises(ConfigError, match=r"ends in \.html, \.mp4, \.npz, \.csv, \.parquet"):
        run("planar").save(tmp_path / "run.txt")
    with pytest.raises(ConfigError, match=r"ends in one of \.npz, \.csv, \.parquet"):
        snake_env.load_trajectory(tmp_path / "run.txt")


def test_a_notebook_shows_a_player(monkeypatch):
    pytest.importorskip("viser")
    made = run("planar")
    text = made._repr_html_()
    assert text.startswith('<iframe srcdoc="&lt;')
    assert text.endswith("</iframe>")
    assert len(text) > 100_000
    export = __import__("snake_env.viewer.export", fromlist=["MOST"])
    seen = []
    monkeypatch.setattr(export, "_html", lambda frames: seen.append(len(frames)) or "")
    monkeypatch.setattr(export, "MOST", 3)
    assert made._repr_html_() == '<iframe srcdoc="" width="100%" height="480" style="border:0"></iframe>'
    assert seen == [3]
