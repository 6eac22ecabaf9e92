"""The benchmarks compare fairly, keep what was measured, and their page says what the results say."""

import json
import math
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from benchmarks import command, comparison, curves, equal_error, native, page
from benchmarks.curves import Point
from benchmarks.results import REQUIRED, Results
from benchmarks.targets import all_targets

SCENARIO = {
    "robot": {
        "links": 11,
        "length": 0.122,
        "contact_half_length": 0.0393,
        "radius": 0.0525,
        "mass": 7.5 / 11,
        "inertia": 1.32e-3,
        "gravity": 9.81,
    },
    "scene": {"obstacles": [[0.125, 3.0, 0.0]], "friction": [0.2, 0.2]},
    "controller": {"kp": 800.0, "kd": 2.0, "torque_limit": None, "active_from": 0.0},
    "start": [0.5, 0.0, 3.7],
    "joint_angle": [0.0] * 10,
    "duration": 5.0,
}


def scene_record(name="free"):
    reference = {
        "samples": [[[0.1 * i, 0.0] for i in range(11)]] * 50,
        "sample": 0.1,
        "uncertainty": {"worst": 1e-7, "end": 5e-8},
        "steps": [1e-4, 5e-5],
    }
    return {"kind": "scene", "scene": name, "title": "free ground", "scenario": SCENARIO, "reference": reference}


def point_record(error, speed, curve="implicit order 2", scene="free", step=0.01):
    return {
        "kind": "point",
        "scene": scene,
        "curve": curve,
        "integrator": {"step": step},
        "default": curve == "implicit order 2" and step == 0.01,
        "error": error and {"worst": error, "end": error / 2},
        "speed_alone": speed / 4,
        "speed_fleet": None if curve.startswith("thesis") else speed,
        "misses": 0,
    }


def peer_record(error, speed, scene="free"):
    return {
        "kind": "peer",
        "peer": "MuJoCo",
        "scene": scene,
        "curve": "MuJoCo 4",
        "setup": {"step": 0.01, "tolerance": 1e-6, "solver": "CG"},
        "error": {"worst": error, "end": error},
        "speed_alone": speed,
    }


def crowd_record(robots, threads, rate, actions="gait"):
    return {
        "kind": "growth",
        "axis": "batch",
        "env": "SnakeCourse-v1",
        "actions": actions,
        "robots": robots,
        "threads": threads,
        "steps_per_second": rate,
        "steps_per_cpu_second": rate / threads,
        "utilisation": 0.97,
    }


def fleet_record(axis, links, pegs, cost):
    return {
        "kind": "growth",
        "axis": axis,
        "scene": "free",
        "links": links,
        "pegs": pegs,
        "us_per_step": cost,
        "us_per_link": cost / links,
        "us_per_look": None,
        "iterations_per_step": 9.0,
        "events_per_step": 0.1,
    }


RECORDS = [
    scene_record(),
    point_record(1e-4, 4000.0),
    point_record(1e-3, 16000.0, step=0.05),
    point_record(None, 900.0, step=0.1),
    point_record(2e-4, 400.0, "thesis, own tolerance", step=2.5e-4),
    peer_record(1e-4, 40.0),
    peer_record(4e-3, 500.0),
    crowd_record(64, 1, 160_000.0),
    crowd_record(64, 2, 310_000.0),
    crowd_record(256, 1, 156_000.0),
    crowd_record(256, 1, 60_000.0, "random"),
    crowd_record(1024, 1, 150_000.0),
    fleet_record("links", 11, 0, 2.0),
    fleet_record("links", 200, 0, 40.0),
    fleet_record("pegs", 11, 10, 4.0),
    fleet_record("pegs", 11, 10_000, 4.1),
    {
        "kind": "skip",
        "feature": "pegs",
        "off": "none",
        "on": "far",
        "idle": True,
        "unit": "step",
        "us_off": 2.0,
        "us_on": 2.2,
        "ratio": 1.1,
        "ratio_low": 1.09,
        "ratio_high": 1.11,
    },
    {"kind": "pressed", "bend": 1.1, "pairs": 5.2, "us_step": 9.0, "us_solve": 0.6, "solves": 15.0},
    {
        "kind": "certificate",
        "what": "free",
        "percent": [50.0, 90.0, 99.0, 100.0],
        "residual": [1e-9] * 4,
        "gap": [1e-12] * 4,
        "iterations": [5.0] * 4,
        "misses": 0,
        "above_tolerance": 0,
        "steps": 500,
        "events": 3,
    },
    {"kind": "interface", "robots": 256, "Gymnasium [us]": 3.7},
    {"kind": "learning", "env": "SnakeSpatial-v1", "robots": 64, "simulator [us]": 60.0, "learner [us]": 20.0},
    {
        "kind": "width",
        "env": "SnakeCourse-v1",
        "actions": "gait",
        "lanes": 4,
        "robots": 256,
        "steps_per_cpu_second": 9e4,
    },
    *(
        {
            "kind": "equal_error",
            "env": "SnakeCourse-v1",
            "actions": "joints",
            "period": 0.05,
            "party": party,
            "setup": {},
            "shown": shown,
            "error": error,
            "work_bias": bias,
            "cost": cost,
        }
        for party, shown, error, bias, cost in (
            ("ours", True, 1e-3, -0.04, 1e-3),
            ("ours", False, 1e-4, 0.0, 4e-3),
            ("MuJoCo", True, 4e-3, -0.3, 4e-3),
            ("MuJoCo", False, 2e-4, -0.02, 0.08),
        )
    ),
    {"kind": "run", "command": "make bench", "machine": {"cpu": "one"}, "commit": "0", "seconds": 60.0},
]

SKIP, EQUAL = ([record["kind"] for record in RECORDS].index(kind) for kind in ("skip", "equal_error"))


@pytest.fixture
def results():
    made = Results.begin("make bench", quick=False)
    for record in RECORDS:
        made.add(record)
    made.complete = True
    return made


def test_every_kind_of_record_is_known_and_incomplete_ones_are_refused(results):
    assert {record["kind"] for record in RECORDS} == set(REQUIRED)
    with pytest.raises(ValueError, match="unknown kind"):
        results.add({"kind": "guess"})
    with pytest.raises(ValueError, match="no ratio"):
        results.add({k: v for k, v in RECORDS[SKIP].items() if k != "ratio"})


def test_results_survive_writing_and_reading(results, tmp_path):
    results.write(tmp_path / "results.json")
    assert Results.read(tmp_path / "results.json") == results
    content = json.loads((tmp_path / "results.json").read_text())
    assert content["machine"]["cpu"]
    assert content["commit"]
    assert content["versions"]["numpy"] == np.__version__


def test_a_frontier_holds_what_nothing_beats():
    points = [Point(e, s, {}) for e, s in [(1.0, 10.0), (2.0, 5.0), (3.0, 30.0), (1.0, 8.0), (4.0, 30.0)]]
    assert [(p.error, p.speed) for p in curves.frontier(points)] == [(1.0, 10.0), (3.0, 30.0)]


def test_speeds_are_interpolated_between_logarithms_and_never_beyond_the_most_accurate_point():
    curve = [Point(1e-4, 10.0, {}), Point(1e-2, 1000.0, {})]
    assert math.isclose(curves.speed_at(curve, 1e-3), 100.0)
    assert curves.speed_at(curve, 1e-4) == 10.0
    assert curves.speed_at(curve, 1.0) == 1000.0, "what is more accurate than asked for is good enough"
    assert curves.speed_at(curve, 0.9e-4) is None
    assert curves.speed_at([], 1.0) is None


def test_errors_below_what_the_reference_is_worth_are_not_believed(results):
    results.add(point_record(1e-9, 5.0, step=1e-3))
    best = min(curves.points(results, "free", curves.OURS), key=lambda p: p.error)
    assert math.isclose(best.error, curves.TRUST * 1e-7)


def test_a_robot_that_is_somewhere_else_is_not_a_point(results):
    results.add(peer_record(0.6, 1e6))
    assert max(p.speed for p in curves.points(results, "free", "MuJoCo")) == 500.0


def test_targets_are_judged_by_the_least_favourable_point(results):
    rows = {target.what: target for target in all_targets(results)}
    ahead = "random actions {}, worst case: cost of MuJoCo over ours at {} mm"
    assert rows[ahead.format("in the plane", 1)].measured == "16x (SnakeCourse-v1, joints)"
    assert rows[ahead.format("in the plane", 1)].met is False
    assert rows[ahead.format("in the plane", 0.1)].measured == "not reached by MuJoCo's steps"
    assert rows[ahead.format("in the plane", 0.1)].met is None
    assert rows[ahead.format("in 3D", 0.3)].met is None
    threads = rows["two threads over one, 64 robots and more, worst environment"]
    assert threads.measured == "1.94x (SnakeCourse-v1, gait, 64 robots)"
    assert threads.met is False
    assert rows["interface, 256 robots: Gymnasium [us]"].met
    assert rows["interface, 256 robots: SB3 [us]"].met is None
    learning = rows["Stable-Baselines3's PPO in 3D: share of the simulator"]
    assert (learning.measured, learning.met) == ("75 %", False)
    assert rows["growth with links, free: time per link"].met
    assert rows["growth with pegs in the field: time per step"].met
    assert rows["a feature the scene does not need"].met is False
    assert rows["default step, free: error of the worst link over the run"].met
    assert rows["default step, course-7.5: error of the worst link over the run"].met is None
    assert rows["every stage verified, scenes and random fields"].met


def test_nothing_measured_is_neither_met_nor_missed():
    assert {target.met for target in all_targets(Results.begin("make bench", quick=True))} == {None}


def test_the_page_has_every_section_and_only_whole_tables(results):
    text = page.render(results, "images")
    for heading in (
        "Cost at equal error under random actions",
        "Environment steps per second",
        "Targets",
        "Error against run time",
        "Growth",
        "What a feature costs",
        "Certificates",
        "Interface",
    ):
        assert f"## {heading}" in text
    for block in text.split("\n\n"):
        widths = {line.count("|") for line in block.splitlines() if line.startswith("|")}
        assert len(widths) <= 1, block
    assert "images/bench-free.png" in text
    assert "| `SnakeCourse-v1` | joints | 0.1 | 4 | +0.0 % | not reached | - | - |" in text
    assert "| `SnakeCourse-v1` | joints | 1 | 1 | -4.0 % | 16 | -17.0 % | 16x |" in text
    assert "| `SnakeCourse-v1` | joints | 20,000 | 1 | -4 % | 5,000 | 4 | -30 % |" in text
    assert "100.0x" in comparison.render(results, "images"), "4,000 against 40 at 0.1 mm"


def test_an_unfinished_run_is_reported(results):
    results.complete = False
    assert "Stopped before the end" in page.render(results, "images")


def test_the_committed_page_is_what_the_committed_results_say():
    committed = Results.read(command.DOCS / "benchmarks.json")
    checked = Results.begin("", quick=False)
    for record in committed.records:
        checked.add(record)
    assert committed.complete
    assert not committed.quick
    assert (command.DOCS / "benchmarks.md").read_text() == page.render(committed, "images", published=True)
    assert all(block(committed) in other.read_text() for other, block in equal_error.PAGES.items())


def test_a_later_run_renews_what_it_has_measured(results):
    later = Results.begin("make bench --parts", quick=False)
    later.add(fresh := RECORDS[EQUAL] | {"cost": 5.0})
    again = results.renewed(later).renewed(later)
    assert again.of("equal_error") == [fresh]
    assert [run["command"] for run in again.of("run")] == ["make bench", "make bench --parts"]
    assert again.of("point") == results.of("point")
    assert "Measured anew by `make bench --parts`" in page.render(again, "images")


def test_a_later_run_of_one_scene_leaves_the_others(results):
    later = Results.begin("make bench --parts spatial", quick=False)
    point = results.of("point")[0]
    later.add(fresh := point | {"scene": "jam"})
    again = results.renewed(later)
    assert again.of("point", scene="jam") == [fresh]
    assert again.of("point", scene=point["scene"]) == results.of("point", scene=point["scene"])


def pretend(monkeypatch, tmp_path, script):
    """Lets a Python script stand in for the measuring program."""
    program = tmp_path / "program"
    program.write_text(f"#!{sys.executable}\nimport json, sys, time\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setattr(native, "build", lambda: program)


EMIT = f"records = json.loads({json.dumps(json.dumps(RECORDS))})\nfor r in records: print(json.dumps(r), flush=True)"


@pytest.mark.skipif(sys.platform == "win32", reason="scripts are not programs there")
def test_the_command_measures_and_writes_results_pictures_and_page(monkeypatch, tmp_path, capsys):
    pretend(monkeypatch, tmp_path, "print('working', sys.argv[1:], file=sys.stderr)\n" + EMIT)
    out = tmp_path / "out"
    assert command.main(["--quick", "--parts", "precision", "skip", "--scenes", "free", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert "working ['precision', 'skip', '--quick'" in printed.err
    assert "| target | aim | measured |" in printed.out
    names = {path.name for path in out.iterdir()}
    assert {"results.json", "README.md", "bench-free.png", "bench-growth.png"} <= names
    assert Results.read(out / "results.json").complete


def test_the_interface_is_timed_without_physics():
    (row,) = command.interface(quick=True)
    assert row["robots"] == 256
    assert row["Gymnasium [us]"] > 0
    assert row["SB3 [us]"] > 0


def test_simulator_and_learner_take_no_more_than_the_time_of_learning():
    start = time.perf_counter()
    (row,) = command.learning(quick=True)
    assert row["robots"] == 64
    assert min(row["simulator [us]"], row["learner [us]"]) > 0
    rollout = 64 * 32
    assert 1e-6 * rollout * (row["simulator [us]"] + row["learner [us]"]) < time.perf_counter() - start


@pytest.mark.skipif(sys.platform == "win32", reason="scripts are not programs there")
def test_an_interruption_keeps_what_was_measured(monkeypatch, tmp_path):
    pretend(monkeypatch, tmp_path, EMIT + "\ntime.sleep(60)")
    measured = []

    def interrupt(self, record, add=Results.add):
        add(self, record)
        measured.append(record)
        if len(measured) == len(RECORDS):
            raise KeyboardInterrupt

    monkeypatch.setattr(Results, "add", interrupt)
    out = tmp_path / "out"
    assert command.main(["--parts", "precision", "--out", str(out)]) == 130
    kept = Results.read(out / "results.json")
    assert not kept.complete
    assert kept.records == RECORDS


@pytest.mark.skipif(sys.platform == "win32", reason="scripts are not programs there")
def test_a_failing_program_is_an_error_and_keeps_what_it_had_measured(monkeypatch, tmp_path):
    pretend(monkeypatch, tmp_path, EMIT + "\nsys.exit(3)")
    out = tmp_path / "out"
    with pytest.raises(native.subprocess.CalledProcessError):
        command.main(["--parts", "precision", "--out", str(out)])
    assert Results.read(out / "results.json").records == RECORDS


def test_unknown_parts_are_named(capsys):
    with pytest.raises(SystemExit):
        command.main(["--parts", "speed"])
    assert "speed" in capsys.readouterr().err


class TestMujoco:
    """The peer is the same robot."""

    @pytest.fixture(autouse=True)
    def installed(self):
        pytest.importorskip("mujoco")

    def test_it_has_the_same_links_and_each_is_pressed_to_the_ground_by_its_weight(self):
        from benchmarks import mujoco_model

        setup = mujoco_model.Setup(0.01)
        model = mujoco_model.build(SCENARIO, setup)
        data = mujoco_model.placed(model, SCENARIO)
        mujoco_model.mujoco.mj_kinematics(model, data)
        assert (model.nv, model.nu) == (13, 10)
        assert np.allclose(data.xipos[-11], [0.5, 0.0, 0.0])
        distance = np.linalg.norm(np.diff(data.xipos[-11:], axis=0), axis=1)
        assert np.allclose(distance, 0.122), "a straight chain"
        data.ctrl[:] = SCENARIO["joint_angle"]
        force = mujoco_model.normal_force(model, data)
        assert np.allclose(force, 7.5 / 11 * 9.81, rtol=1e-6)

    def test_it_slides_under_coulomb_friction(self):
        from benchmarks import mujoco_model

        model = mujoco_model.build(SCENARIO, mujoco_model.Setup(1e-3))
        data = mujoco_model.placed(model, SCENARIO)
        data.qvel[0] = 0.1
        for _ in range(20):
            mujoco_model.mujoco.mj_step(model, data)
        assert math.isclose(data.qvel[0], 0.1 - 0.02 * 0.2 * 9.81, rel_tol=0.01)

    @pytest.mark.parametrize("direction", [0.0, np.pi / 4, np.pi / 2])
    def test_its_friction_differs_along_and_across_a_link(self, direction):
        """On a robot that slides, heading 3.7 rad, force and velocity are as in maximal dissipation on the ellipse."""
        from benchmarks import mujoco_model

        friction = np.array([0.2, 0.5])
        scenario = SCENARIO | {"scene": {"obstacles": [], "friction": friction.tolist()}}
        model = mujoco_model.build(scenario, mujoco_model.Setup(1e-3))
        data = mujoco_model.placed(model, scenario)
        heading = 3.7 + direction
        data.qvel[:2] = start = np.array([np.cos(heading), np.sin(heading)])
        mujoco_model.mujoco.mj_step(model, data)
        axes = np.array([[np.cos(3.7), np.sin(3.7)], [-np.sin(3.7), np.cos(3.7)]])
        towards = friction**2 * (axes @ start)
        expected = towards / np.linalg.norm(towards / friction)
        # The velocity turns by 0.5 g 1e-3 s in the step, and the force with it.
        np.testing.assert_allclose(axes @ (start - data.qvel[:2]) / (9.81 * 1e-3), expected, atol=5e-3)

    def test_each_link_is_pressed_to_the_ground_by_its_weight_in_motion_too(self):
        """Bent and moving, under a servo's torque, where the normal force is calibrated straight and at rest."""
        from benchmarks import mujoco_model

        model = mujoco_model.build(SCENARIO, mujoco_model.Setup(1e-3))
        data = mujoco_model.placed(model, SCENARIO)
        random = np.random.default_rng(0)
        data.qpos[3:], data.qvel[:] = random.uniform(-0.8, 0.8, 10), random.uniform(-1.0, 1.0, 13)
        data.ctrl[:] = random.uniform(-0.8, 0.8, 10)
        force = mujoco_model.normal_force(model, data)
        np.testing.assert_allclose(force, 7.5 / 11 * 9.81, rtol=1e-3)

    def test_a_point_is_a_complete_record(self, results):
        from benchmarks import mujoco_peer

        scene = scene_record()
        samples = np.array(scene["reference"]["samples"])
        record = mujoco_peer.point("free", scene["scenario"], samples, 0.1, mujoco_peer.setups(True, True)[0])
        results.add(record)
        assert record["error"]["worst"] >= record["error"]["end"] > 0.0
        json.dumps(record)


def test_documents_name_no_file_that_is_missing():
    text = Path(command.DOCS / "benchmarks.md").read_text()
    pictures = [line.split("(")[1].rstrip(")") for line in text.splitlines() if line.startswith("![")]
    assert pictures
    assert all((command.DOCS / picture).exists() for picture in pictures)
