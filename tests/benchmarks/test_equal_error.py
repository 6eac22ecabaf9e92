"""Cost at equal error: set-points that are ours, restarts in our states, MuJoCo near our limit."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mujoco")

import mujoco

from benchmarks import command, equal_error, settings_search
from benchmarks.mujoco_model import DEFAULT, Setup
from benchmarks.restarts import SCENES, Case, Course, Mujoco, Ours, coordinates
from benchmarks.results import Results
from benchmarks.set_points import set_points


@pytest.mark.parametrize(
    ("case", "within"),
    [
        (Case("SnakeCourse-v1", "gait"), 1e-14),
        (Case("SnakeFree-v1", "joints"), 1e-14),
        # In 3D torques are solved for, here to residuals of 1e-5 m/s.
        (Case("SnakeSpatial-v1", "joints"), 1e-4),
    ],
)
def test_set_points_give_our_torques(case, within):
    envs = Case(case.env, case.actions, (("controller", {"torque_limit": None}),)).make(SCENES, {})
    gains, lead = envs.layout["config"]["controller"], 2.0 / 800.0
    posture = envs.state().joint_angle.reshape(SCENES, -1)
    shape = (12, SCENES, len(envs.layout["action"]))
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, shape).astype(np.float32)
    expected = set_points(envs.layout["action"], posture, actions.astype(float), envs.control_period, 0.01, lead)
    for action, points in zip(actions, expected, strict=True):
        envs.step(action)
        state = envs.state()
        torque = gains["kp"] * (points[-1].reshape(state.joint_angle.shape) - state.joint_angle)
        torque -= gains["kd"] * state.joint_rate
        np.testing.assert_allclose(-state.joint_torque, torque, atol=gains["kp"] * within)


@pytest.mark.parametrize("env", ["SnakeCourse-v1", "SnakeSpatial-v1"])
def test_mujocos_robots_start_where_ours_are_and_as_fast(env):
    course = Course(Case(env, "joints"), SCENES, 5, {"step": 0.0005})
    start = course.periods[-1].start
    player = Mujoco(course, settings_search.setups("spatial" if "Spatial" in env else "planar", (0.001,), 1)[0])
    model = player.models[0]
    data = mujoco.MjData(model)
    qpos, qvel = coordinates(start)
    data.qpos[:], data.qvel[:] = qpos[0], qvel[0]
    mujoco.mj_forward(model, data)
    size = start.link_position.shape[-1]
    velocity = np.empty((model.nbody, 6))
    for body in range(model.nbody):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity[body], 0)
    links = slice(-start.link_position.shape[1], None)
    np.testing.assert_allclose(data.xipos[links, :size], start.link_position[0], atol=1e-9)
    np.testing.assert_allclose(velocity[links, 3 : 3 + size], start.link_velocity[0], atol=1e-5)


@pytest.mark.parametrize("case", [Case("SnakeCourse-v1", "gait"), Case("SnakeFree-v1", "joints")])
def test_mujoco_converges_to_our_limit(case):
    """One period, among pegs and on orthotropic ground: first order in its step, without a floor of the model's."""
    course = Course(case, 2 * SCENES, 9, {"precision": "fine"})
    players = [Mujoco(course, Setup(step, 1e-4, 1e-4, DEFAULT)) for step in (2e-3, 2.5e-4)]
    (coarse, bias, _), (fine, fine_bias, _) = (course.errors(player, [4, 8]) for player in players)
    assert np.median(fine) < 0.2 * np.median(coarse) < 0.2e-3
    assert abs(fine_bias) < min(0.02, abs(bias)), "the actuators' work converges too"


@pytest.mark.parametrize("step", [0.005, 0.025])
def test_mujocos_torque_stays_near_its_limit_in_long_steps(step):
    """Where a servo of limited force bangs between its limits, with positions meters off and work times ten."""
    course = Course(Case("SnakeCourse-v1", "joints"), SCENES, 9, {"precision": "fine"})
    errors, bias, _ = course.errors(Mujoco(course, Setup(step, 1e-2, 2e-3, DEFAULT)), [4, 8])
    assert np.median(errors) < 0.02
    assert abs(bias) < 0.6


def test_ours_restarts_as_if_it_had_not_stopped():
    course = Course(Case("SnakeField-v1", "joints"), SCENES, 6, {})
    error, bias, seconds = course.errors(Ours(course, {}), [4])
    assert error.max() == bias == 0.0 < seconds


def test_one_command_renews_its_part_of_the_pages(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{equal_error.BEGIN}\nold\n{equal_error.END}\nafter\n")
    before = Results.read(command.DOCS / command.PUBLISHED)
    before.write(tmp_path / command.PUBLISHED)
    plan = settings_search.Plan(settings_search.CASES[:1], SCENES, (4,), 1, 1, (0.01, 0.002), 1)
    monkeypatch.setattr(settings_search, "QUICK", plan)
    monkeypatch.setattr(command, "DOCS", tmp_path)
    monkeypatch.setattr(equal_error, "PAGES", {page: equal_error.costs})
    monkeypatch.setattr(command.figures, "draw_all", lambda *_: [])
    words = ["--quick", "--parts", "equal-error", "--write-docs", "--out", str(tmp_path / "out")]
    assert command.main(words) == 0
    after = Results.read(tmp_path / command.PUBLISHED)
    ours, other = after.of("equal_error", shown=True)
    assert (ours["party"], ours["setup"]) == ("ours", {})
    assert (other["party"], other["setup"]["step"]) == ("MuJoCo", settings_search.SHOWN_STEP)
    assert equal_error.ratio(after, ("SnakeCourse-v1", "joints"), 5.0) > 1.0
    assert after.of("point") == before.of("point")
    assert page.read_text() == f"before\n{equal_error.costs(after)}\nafter\n"
    assert equal_error.render(after, published=True) in (tmp_path / "benchmarks.md").read_text()
