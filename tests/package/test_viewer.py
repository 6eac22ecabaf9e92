"""The viewer: frames of planar and 3D robots, files, and the page in a headless browser."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import running

import snake_env
from experiments import browser_pictures as pictures
from snake_env import ConfigError, Gait, Patch, Scene
from snake_env.__main__ import main
from snake_env.evaluation import tasks
from snake_env.evaluation.tasks import BenchmarkTask

pytest.importorskip("viser")

from snake_env.palette import BODY, FORCE_SCALE, LONGEST_ARROW
from snake_env.viewer.drawing import NO_ARROW, Drawing, arrows
from snake_env.viewer.frames import Frames
from snake_env.viewer.live import Live, fitting
from snake_env.viewer.player import Player
from snake_env.viewer.pull import force

NEEDS_BROWSER = pytest.mark.skipif(pictures.CHROMIUM is None, reason="Chromium is not installed")


@pytest.fixture(scope="module")
def run():
    return snake_env.simulate(scene=Scene.preset("table-7.5"), duration=0.5, sample=0.05)


@pytest.fixture
def browser():
    pytest.importorskip("playwright.sync_api")
    with pictures.browser() as found:
        yield found


def centre_lines(frames: Frames):
    """Images of the z axis under the quaternions (T, L, 3)."""
    w, x, y, z = np.moveaxis(frames.quaternion, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def test_frames_of_a_planar_run_lie_along_the_links(run):
    frames = Frames.of_trajectory(run)
    assert (len(frames), frames.position.shape, frames.quaternion.shape) == (11, (11, 11, 3), (11, 11, 4))
    along = np.stack([np.cos(run.angle), np.sin(run.angle), np.zeros_like(run.angle)], axis=-1)
    np.testing.assert_allclose(centre_lines(frames), along, atol=1e-12)
    np.testing.assert_array_equal(frames.position[..., 2], np.tile(frames.radius, (11, 1)))
    assert frames.scene == Scene.preset("table-7.5")


def test_frames_of_a_run_from_mappings_have_its_robot_and_scene():
    scene = {"obstacles": [(0.1, 1.0, 0.0)]}
    run = snake_env.simulate(robot={"links": 3, "radius": 0.02}, scene=scene, duration=0.1)
    frames = Frames.of_trajectory(run)
    assert (frames.radius.tolist(), frames.scene.obstacles) == ([0.02] * 3, ((0.1, 1.0, 0.0),))


def test_frames_of_a_3d_run_join_in_the_joints():
    run = snake_env.simulate(model="spatial", gait=Gait.sidewinding(), duration=0.3, sample=0.1)
    frames = Frames.of_trajectory(run)
    assert frames.joint_angle.shape == (4, 20)
    apart = frames.position[:, 1:] - frames.position[:, :-1]
    along = centre_lines(frames)
    np.testing.assert_allclose(apart / np.linalg.norm(apart, axis=-1, keepdims=True), along[:, 1:], atol=0.5)


def test_frames_of_states_and_of_a_run_agree():
    envs = snake_env.load_policy("corridor").make_vec(1)
    envs.reset(seed=0)
    state = envs.unwrapped.state().robot(0)
    frames = Frames.of_states([state], envs.unwrapped.scene(0))
    along = np.stack([np.cos(state.link_angle), np.sin(state.link_angle), 0 * state.link_angle], axis=-1)
    np.testing.assert_allclose(centre_lines(frames)[0], along, atol=1e-12)
    assert frames.goal.shape == (2,)
    envs.close()


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_the_mark_is_on_top_of_a_robot_that_lies_flat(model):
    frames = Frames.of_trajectory(snake_env.simulate(model, gait=Gait(amplitude=0.0), duration=0.1))
    w, *vector = np.moveaxis(frames.quaternion[0], -1, 0)
    vector, back = np.stack(vector, axis=1), np.array(frames.back)
    turned = back + 2.0 * np.cross(vector, np.cross(vector, back) + w[:, np.newaxis] * back)
    np.testing.assert_allclose(turned, np.broadcast_to([0.0, 0.0, 1.0], turned.shape), atol=1e-6)


def test_arrows_of_large_forces_are_cut():
    points = arrows(np.zeros((1, 3)), np.array([[0.0, 1000.0, 0.0]]))
    assert np.linalg.norm(points[0, 1] - points[0, 0]) == pytest.approx(LONGEST_ARROW)


def test_arrows_have_the_length_of_the_forces():
    force = np.array([[3.0, 4.0, 0.0], [0.01, 0.0, 0.0], [0.0, -2.0, 0.0]])
    found = arrows(np.zeros((3, 3)), force)
    lengths = np.linalg.norm(found[:, 1] - found[:, 0], axis=1)
    np.testing.assert_allclose(lengths, [5.0 * FORCE_SCALE, 2.0 * FORCE_SCALE])
    assert arrows(np.zeros((3, 3)), 0.0 * force) is NO_ARROW


def test_a_run_is_saved_as_a_page_and_a_film(run, tmp_path):
    page = run.save(tmp_path / "run.html")
    text = page.read_text(encoding="utf-8")
    assert "__VISER_EMBED_DATA__" in text
    assert "<script src=" not in text
    pytest.importorskip("imageio")
    film = run.save(tmp_path / "run.mp4")
    assert film.stat().st_size > 1000
    with pytest.raises(ConfigError, match=r"path = run.txt: expected a name that ends in .html, .mp4"):
        run.save("run.txt")


def test_patches_lie_on_the_ground_in_their_colours():
    corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    scene = Scene(patches=[Patch(corners, 0.0), Patch(corners, 4.0)])
    shown = {}
    stage = SimpleNamespace(
        add_mesh_simple=lambda name, vertices, faces, **look: shown.update({name: (vertices, look["color"])}),
        **{name: lambda *values, **look: None for name in ("add_grid", "add_arrows", "add_line_segments")},
    )
    drawing = Drawing.__new__(Drawing)
    drawing._scene, drawing.solids = stage, []
    drawing._obstacles(Frames.of_trajectory(snake_env.simulate(scene=scene, duration=0.1, sample=0.1)))
    (ice, blue), (rug, brown) = shown["/patches/0"], shown["/patches/1"]
    assert 0.0 < ice[:, 2].max() < rug[:, 2].max() < 0.004
    assert blue[2] > blue[0]
    assert brown[2] < brown[0]


def test_200_links_among_1000_pegs_are_one_batch_each():
    grid = [(0.05, 2.0 + 0.5 * i, -8.0 + 0.5 * k) for i in range(32) for k in range(32)][:1000]
    long = snake_env.simulate(
        robot=snake_env.Robot(links=200), scene=Scene(obstacles=grid), duration=0.05, sample=0.05, self_contact=False
    )
    player = long.view(port=0)
    player.stop()
    assert len(player._drawing._shapes) == 2, "links, and the marks on them"


def test_a_live_robot_follows_its_policy_and_its_sliders():
    with running(Live(tasks.load()["course"], port=0)) as live:
        live.playing.value = False
        before = live._actor.action.copy()
        live.amplitude.value = 20.0
        live._steer()
        assert not np.array_equal(before, live._actor.action)
        live.policy.value = "thrifty"
        live._again(forget=True)
        assert live._actor.name == "thrifty"
        pose, place = live.state.link_position, live._env.unwrapped.scene(0).obstacles[0]
        live.move(1, 0.0, 0.2)
        assert live._env.unwrapped.scene(0).obstacles[0][2] == pytest.approx(place[2] + 0.2)
        np.testing.assert_allclose(live.state.link_position, pose, atol=1e-9)
        live.move(1, 0.0, -0.5)
        assert "expected a place that leaves the start free" in live.note.content
        live.task.value = "maze"
        live.policy.value = "follow-the-leader"
        live._again(forget=True)
        assert "tuned for maze" in live.note.content
        assert live._actor.name == "thrifty"


def test_a_pulled_link_follows_the_handle():
    with running(Live(BenchmarkTask("free", "SnakeFree-v1", {"friction": (0.05, 0.05)}, ""), port=0)) as live:
        live.playing.value = False
        live.link.value = 6
        live._take_hold()
        place = live.state.link_position[5].copy()
        live.advance(1)
        assert live._pull.impulse(live.state, 0.05) is None, "nobody drags the handle"
        live._pull._drag(True)
        live._pull._handle.position = (place[0], place[1] + 1.0, 0.1)
        live.advance(8)
        assert live.state.link_position[5, 1] > place[1] + 0.1
        live.link.value = 0
        live._take_hold()
        assert live._pull is None


def test_what_is_clicked_gets_a_handle():
    with running(Live(tasks.load()["course"], port=0)) as live:
        live.playing.value = False

        def click(point, target):
            eye = np.array([0.0, -1.0, 1.0])
            click_ = {"ray_origin": tuple(eye), "ray_direction": tuple(np.append(point, 0.05) - eye)}
            live._clicked(SimpleNamespace(target=SimpleNamespace(name=target), **click_))

        with live._lock:  # a step may still be under way
            pegs = live._env.unwrapped.scene(0).obstacles[:3]
        for j, (_, x, y) in enumerate(pegs):
            click((x, y), "/pegs")
            assert (live.obstacle.value, live.link.value) == (j + 1, 0)
            assert live._handle is not None
        click(live.state.link_position[6], "/links/0")
        assert live.link.value == 7
        assert live._pull is not None
        live._clicked(SimpleNamespace(ray_origin="x", ray_direction=(0.0, 0.0, 0.0), target=None))
        assert live.link.value == 7


@pytest.mark.parametrize(
    ("task", "policy"),
    [
        ("field-medium", "general"),
        ("maze", "general"),
        ("spatial-open", "spatial"),
        ("spatial-field", "spatial-field"),
        ("SnakePipe-v1", "gait"),
        ("SnakeFree-v1", "gait"),
    ],
)
def test_without_a_policy_one_that_fits_the_task_acts(task, policy):
    where = tasks.load().get(task) or BenchmarkTask(task, task)
    assert fitting(where) == policy
    tasks.acting_in(policy, where)


def test_a_spring_is_limited_and_damped():
    np.testing.assert_allclose(force(np.array([0.1, 0.0]), np.zeros(2)), [6.0, 0.0])
    assert np.linalg.norm(force(np.array([5.0, 5.0]), np.zeros(2))) == pytest.approx(30.0)
    np.testing.assert_allclose(force(np.zeros(2), np.array([0.0, 1.0])), [0.0, -6.0])


def test_keys_move_the_sliders_of_the_gait_as_far_as_they_go():
    with running(Live(BenchmarkTask("course", "SnakeCourse-v1", {}, ""), port=0)) as live:
        live.playing.value = False
        before = live._actor.action.copy()
        live.drive(live.gamma, 2.0)
        assert live.gamma.value == 2.0
        assert live._actor.action[3] > before[3]
        live.drive(live.omega, 1000.0)
        assert live.omega.value == live.omega.max


def test_bad_input_of_the_command_is_refused(capsys):
    assert main(["view", "--policy", "nix", "--port", "8999"]) == 2
    assert "policy = nix" in capsys.readouterr().err


@NEEDS_BROWSER
def test_the_page_shows_a_robot_that_moves(browser, tmp_path):
    with running(Live(BenchmarkTask("course", "SnakeCourse-v1", {}, ""), port=0)) as live:
        page = browser.new_page(viewport={"width": 640, "height": 480})
        page.goto(live.url)
        page.get_by_text("amplitude [deg]").wait_for(timeout=60_000)
        field = page.get_by_text("amplitude [deg]").locator("xpath=ancestor::*[.//input][1]").locator("input").last
        before = live._actor.action.copy()
        field.fill("25")
        field.press("Enter")
        limit = time.monotonic() + 30
        while np.array_equal(live._actor.action, before) and time.monotonic() < limit:
            page.wait_for_timeout(200)
        assert live.amplitude.value == 25.0
        assert not np.array_equal(live._actor.action, before)
        # Time begins anew with an episode.
        started = float(live.state.time)
        limit = time.monotonic() + 30
        while float(live.state.time) == started and time.monotonic() < limit:
            page.wait_for_timeout(200)
        assert float(live.state.time) != started
        page.screenshot(path=tmp_path / "page.png", timeout=120_000)
        assert len(set((tmp_path / "page.png").read_bytes())) > 100


@NEEDS_BROWSER
def test_a_link_is_chosen_by_a_click(browser):
    with running(Live(BenchmarkTask("course", "SnakeCourse-v1", {}, ""), port=0)) as live:
        live.playing.value = False
        page = browser.new_page(viewport={"width": 1000, "height": 600})
        page.goto(live.url)
        page.get_by_text("amplitude [deg]").wait_for(timeout=60_000)
        page.wait_for_timeout(2000)
        for y in range(180, 460, 20):
            if live.link.value or live.obstacle.value:
                break
            page.mouse.click(340, y)
            page.wait_for_timeout(300)
        assert live.link.value or live.obstacle.value


@NEEDS_BROWSER
def test_the_camera_follows_the_robot(browser):
    with running(Live(BenchmarkTask("course", "SnakeCourse-v1", {}, ""), policy="general", port=0)) as live:
        live.playing.value = False
        page = browser.new_page(viewport={"width": 640, "height": 480})
        page.goto(live.url)
        page.get_by_text("follow the robot").wait_for(timeout=60_000)
        limit = time.monotonic() + 30
        while not live.server.get_clients() and time.monotonic() < limit:
            page.wait_for_timeout(200)
        (client,) = live.server.get_clients().values()

        def centre():
            return live.state.link_position.mean(axis=0)[:2]

        def comes_to(offset):
            """Whether the page shows the robot from there, for a second: what it reports lags on a busy machine."""
            limit, held = time.monotonic() + 60, 0
            while held < 5 and time.monotonic() < limit:
                page.wait_for_timeout(200)
                seen = client.camera.position - client.camera.look_at
                at_robot = np.allclose(client.camera.look_at[:2], centre(), atol=2e-3)
                held = held + 1 if at_robot and np.allclose(seen, offset, atol=2e-3) else 0
            return held == 5

        first = live.server.initial_camera
        offset = np.subtract(first.position, first.look_at)
        assert comes_to(offset)
        place = centre()
        live.advance(60)
        assert comes_to(offset)
        assert np.linalg.norm(centre() - place) > 0.1
        live.camera.following.value = False
        seen, place = client.camera.position.copy(), centre()
        live.advance(20)
        page.wait_for_timeout(500)
        assert np.linalg.norm(centre() - place) > 0.05
        # The view that held for a second may have had its last two millimetres still to come.
        np.testing.assert_allclose(client.camera.position, seen, atol=2e-3)


@NEEDS_BROWSER
def test_the_robot_has_the_colours_of_the_palette(run, browser, tmp_path):
    """By the ratios of red, green and blue, which hardly depend on the light."""
    image = pytest.importorskip("PIL.Image")
    with running(run.view(port=0)) as player:
        page = browser.new_page(viewport={"width": 800, "height": 500})
        page.goto(player.url)
        page.get_by_text("follow the robot").wait_for(timeout=60_000)
        page.wait_for_timeout(3000)
        page.screenshot(path=tmp_path / "page.png", timeout=120_000)
    red, green, blue = np.moveaxis(np.asarray(image.open(tmp_path / "page.png").convert("RGB"), float), -1, 0)
    body = (green > blue) & (blue > 2.0 * red) & (green > 60.0)
    assert body.mean() > 0.003
    assert np.median((blue / green)[body]) == pytest.approx(BODY[0][2] / BODY[0][1], abs=0.06)


@NEEDS_BROWSER
def test_a_saved_page_works_without_network(run, browser, tmp_path):
    page = browser.new_context(offline=True, viewport={"width": 480, "height": 320}).new_page()
    told = []
    page.on("console", lambda message: told.append(message.text))
    page.goto(run.save(tmp_path / "run.html").as_uri())
    limit = time.monotonic() + 60
    while not any("Embedded data loaded" in line for line in told) and time.monotonic() < limit:
        page.wait_for_timeout(200)
    assert any("Embedded data loaded" in line for line in told)


def test_a_player_moves_on_and_stops(run):
    player = Player(Frames.of_trajectory(run), port=0)
    assert player.url.startswith("http://127.0.0.1:")
    for _ in range(200):  # on a busy machine its thread may start late
        if player.time.value > 0.0:
            break
        time.sleep(0.05)
    assert player.time.value > 0.0
    player.stop()
