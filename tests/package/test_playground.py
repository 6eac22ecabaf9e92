"""The playground in a headless browser: the environment is that of Python, and hands and sliders reach it."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import snake_env

api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("PIL")

from experiments import browser_pictures as pictures

pytestmark = [
    pytest.mark.skipif(pictures.CHROMIUM is None, reason="Chromium is not installed"),
    pytest.mark.skipif(not (pictures.PLAYGROUND / "pkg").exists(), reason="built by `make playground`"),
]
SIZE = {"width": 900, "height": 600}
PHONES = [{"width": 360, "height": 740}, {"width": 412, "height": 915}, {"width": 740, "height": 360}]
TOUCHED = 44
"""Least width and height of what a finger touches [pixels]."""
SEED = 3
RESIDUAL = 1e-4
"""The tolerance of the solver [m/s], below any speed that is seen."""


@pytest.fixture(scope="module")
def opened():
    with pictures.browser() as found:
        yield found


@pytest.fixture
def playground(opened):
    """Opens pages, and asserts that they reported no error and fetched nothing from elsewhere."""
    pages, fetched = [], []
    with pictures.served(pictures.PLAYGROUND) as url:

        def visit(query, size=SIZE):
            page = opened.new_page(viewport=size, has_touch=size is not SIZE)
            told = []
            page.on("pageerror", lambda error: told.append(str(error)))
            page.on("request", lambda request: fetched.append(request.url))
            page.goto(f"{url}/index.html?{query}&seed={SEED}")
            page.wait_for_function("window.playground !== undefined", timeout=60_000)
            pages.append((page, told))
            return page

        yield visit
        for page, told in pages:
            assert told == []
            assert page.locator("#message.error").count() == 0
            page.close()
        assert fetched
        assert [one for one in fetched if not one.startswith((url, "data:"))] == []


def numbers(page, call):
    return np.array(page.evaluate(f"Array.from(playground.robot.{call})"))


def steps(page, count):
    page.evaluate(f"for (let k = 0; k < {count}; k++) playground.step()")


def environment(**options):
    common = {"action_mode": "residual", "perception": "body", "nearest_pegs": 8, "max_episode_steps": 2400}
    options = common | {"termination": {"left_corridor": False}} | options
    env = gymnasium.make_vec("SnakeField-v1", num_envs=1, **options)
    observation, _ = env.reset(seed=[SEED])
    return env, observation


def test_the_page_observes_what_the_environment_observes(playground):
    page = playground("task=field&driver=gait&paused")
    env, observation = environment()
    np.testing.assert_allclose(numbers(page, "observation()"), observation[0], rtol=0, atol=1e-6)
    steps(page, 60)
    for _ in range(60):
        env.step(np.zeros((1, 14), np.float32))
    place = numbers(page, "links()").reshape(-1, 7)[:, :2]
    np.testing.assert_allclose(place, env.unwrapped.state().link_position[0], rtol=0, atol=1e-7)


def test_a_shipped_policy_drives_as_it_does_in_python(playground):
    """For a second: among pegs the last digits of its actions grow to centimetres within 2.5 s."""
    page = playground("task=field&driver=general&paused")
    env, observation = environment()
    policy = snake_env.load_policy("general")
    policy.begin(env.unwrapped.layout, 1)
    steps(page, 20)
    for _ in range(20):
        observation, *_ = env.step(policy(observation))
    place = numbers(page, "links()").reshape(-1, 7)[:, :2]
    np.testing.assert_allclose(place, env.unwrapped.state().link_position[0], rtol=0, atol=1e-4)
    assert env.unwrapped.state().distance[0] > 0.15


@pytest.mark.parametrize(
    ("policy", "options"),
    [("spatial", {"task": "free", "goal_distance": 5.0}), ("spatial-field", {"task": "field"})],
)
def test_a_policy_in_3d_drives_as_it_does_in_python(playground, policy, options):
    page = playground(f"model=spatial&task={options['task']}&paused")
    assert page.locator("#driver").input_value() == policy, "the scene's policy drives where none is chosen"
    actor = snake_env.load_policy(policy)
    env, observation = environment(model="spatial", friction=(0.2, 0.2), **actor.env_options, **options)
    actor.begin(env.unwrapped.layout, 1)
    steps(page, 20)
    for _ in range(20):
        observation, *_ = env.step(actor(observation))
    place = numbers(page, "links()").reshape(-1, 7)[:, :3]
    np.testing.assert_allclose(place, env.unwrapped.state().link_position[0], rtol=0, atol=1e-4)
    page.locator("#preset-rolling").click()
    steps(page, 20)
    assert page.locator("#driver").input_value() == "gait"


def test_the_robot_moves_in_real_time_or_faster(playground):
    page = playground("task=field&driver=general&speed=4")
    page.wait_for_timeout(1500)
    assert page.evaluate("JSON.parse(playground.robot.signals()).time") > 0.2
    page.evaluate("playground.setPlaying(false)")
    took = page.evaluate(
        "(() => { const begun = performance.now(); for (let k = 0; k < 200; k++) playground.robot.step();"
        " return performance.now() - begun; })()"
    )
    assert took < 200 * 50, "slower than real time"


def test_a_slider_changes_the_gait(playground):
    page = playground("task=free&driver=gait&paused")
    before = numbers(page, "action()")
    page.locator("#amplitude").evaluate("(it) => { it.value = 20; it.dispatchEvent(new Event('input')); }")
    steps(page, 1)
    after = numbers(page, "action()")
    assert after[0] == pytest.approx((20 - 40) / 25)
    np.testing.assert_array_equal(before[1:], after[1:])


def test_friction_changes_while_the_robot_moves(playground):
    page = playground("task=free&driver=gait&paused")
    steps(page, 40)
    place = numbers(page, "links()")
    page.locator("#across").evaluate("(it) => { it.value = 1; it.dispatchEvent(new Event('input')); }")
    np.testing.assert_array_equal(numbers(page, "links()"), place)
    steps(page, 40)
    assert np.abs(numbers(page, "links()") - place).max() > 0.01


def test_the_number_of_links_makes_another_robot(playground):
    page = playground("task=field&driver=general&paused")
    page.locator("#links").evaluate("(it) => { it.value = 23; it.dispatchEvent(new Event('input')); }")
    page.wait_for_function("playground.robot.links().length === 7 * 23")
    assert page.locator("#driver").input_value() == "gait"
    steps(page, 20)
    assert page.evaluate("playground.robot.residual()") < RESIDUAL


def gaps(page):
    """Distance of every peg from every link, seen from above."""
    pegs = numbers(page, "pegs()").reshape(-1, 3)
    links = numbers(page, "links()").reshape(-1, 7)
    half, radius = snake_env.Robot().contact_half_length, snake_env.Robot().radius
    x, y, z, w = links[:, 3:].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x)], axis=1)
    apart = pegs[:, np.newaxis, 1:] - links[np.newaxis, :, :2]
    along = np.clip((apart * axis).sum(axis=-1), -half, half)
    return np.linalg.norm(apart - along[..., np.newaxis] * axis, axis=-1) - pegs[:, :1] - radius


def drag(page, start, end):
    (x, y), (to_x, to_y) = (page.evaluate(f"playground.view.pixel({a}, {b}, {c})") for a, b, c in (start, end))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(to_x, to_y, steps=8)


def test_a_peg_is_dragged_and_stops_at_the_robot(playground):
    page = playground("task=field&driver=gait&paused")
    page.wait_for_timeout(500)
    pegs = numbers(page, "pegs()").reshape(-1, 3)
    links = numbers(page, "links()").reshape(-1, 7)
    k = int(np.argmin(np.hypot(*(pegs[:, 1:] - [0.6, 0.0]).T)))
    drag(page, (*pegs[k, 1:], 0.15), (pegs[k, 1] + 0.3, pegs[k, 2] + 0.25, 0.15))
    page.mouse.up()
    moved = numbers(page, "pegs()").reshape(-1, 3)
    np.testing.assert_allclose(moved[k, 1:] - pegs[k, 1:], [0.3, 0.25], atol=0.02)
    np.testing.assert_array_equal(np.delete(moved, k, 0), np.delete(pegs, k, 0))
    drag(page, (*moved[k, 1:], 0.15), (*links[3, :2], 0.15))
    page.mouse.up()
    assert gaps(page).min() >= 0.0
    steps(page, 20)
    assert page.evaluate("playground.robot.residual()") < RESIDUAL
    assert gaps(page).min() > -1e-3


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_the_robot_is_pulled_by_the_pointer(playground, model):
    page = playground(f"model={model}&task=free&driver=gait&paused&along=0.1&across=0.1")
    page.wait_for_timeout(500)
    links = numbers(page, "links()").reshape(-1, 7)
    x, y, z = links[5, :3]
    drag(page, (x, y, z), (x + 0.5, y, z))
    steps(page, 20)
    force = numbers(page, "pull_force()")
    page.mouse.up()
    assert 0.0 < np.linalg.norm(force) <= 30.0 + 1e-9
    assert numbers(page, "links()").reshape(-1, 7)[5, 0] > x + 0.2
    steps(page, 1)
    np.testing.assert_array_equal(numbers(page, "pull_force()"), 0.0)
    assert page.evaluate("JSON.parse(playground.robot.signals()).diverged") == 0.0


def test_pegs_are_added_and_removed(playground):
    page = playground("task=free&driver=gait&paused")
    page.wait_for_timeout(500)
    x, y = page.evaluate("playground.view.pixel(0.5, 0.5, 0)")
    page.mouse.dblclick(x, y)
    assert numbers(page, "pegs()") == pytest.approx([0.05, 0.5, 0.5], abs=0.02)
    page.wait_for_timeout(300)
    x, y = page.evaluate("playground.view.pixel(0.5, 0.5, 0.15)")
    page.mouse.dblclick(x, y)
    assert len(numbers(page, "pegs()")) == 0


def test_sidewinding_in_3d_lifts_links_and_carries_the_robot(playground):
    page = playground("model=spatial&task=free&driver=gait&paused")
    before = numbers(page, "links()").reshape(-1, 7)
    steps(page, 100)
    after = numbers(page, "links()").reshape(-1, 7)
    assert np.ptp(after[:, 2]) > 0.01
    assert np.linalg.norm((after - before)[:, :2].mean(axis=0)) > 0.2
    assert page.evaluate("JSON.parse(playground.robot.signals()).unconverged") == 0.0
    page.wait_for_timeout(500)


def test_keys_steer(playground):
    page = playground("task=free&driver=gait&paused")
    page.keyboard.down("ArrowRight")
    steps(page, 1)
    assert numbers(page, "action()")[3] > 0.2
    page.keyboard.up("ArrowRight")
    steps(page, 1)
    assert numbers(page, "action()")[3] == pytest.approx(0.0, abs=0.05)


def double_click(page, x, y, z=0.0):
    page.wait_for_timeout(500)
    page.mouse.dblclick(*page.evaluate(f"playground.view.pixel({x}, {y}, {z})"))


def test_a_peg_on_a_spring_gives_way_up_to_its_stop_and_comes_back(playground):
    page = playground("task=free&driver=gait&paused")
    page.locator("#tool").select_option("spring")
    x, y = numbers(page, "links()").reshape(-1, 7)[5, :2]
    double_click(page, x, y + 0.3)
    ((number, *home),) = numbers(page, "springs()").reshape(-1, 3)
    assert number == 0
    before = numbers(page, "pegs()")
    np.testing.assert_array_equal(before[1:], home)
    drag(page, (x, y, 0.05), (x, y + 0.8, 0.05))
    far = []
    for _ in range(40):
        steps(page, 1)
        far.append(np.linalg.norm(numbers(page, "pegs()")[1:] - home))
    assert 0.05 < max(far) < 0.101
    page.mouse.up()
    page.evaluate("playground.robot.move_peg(0, -5, 0)")  # away from the robot, with its spring
    steps(page, 60)
    np.testing.assert_allclose(numbers(page, "pegs()")[1:], [-5.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(numbers(page, "springs()")[1:], [-5.0, 0.0])
    assert page.evaluate("JSON.parse(playground.robot.signals()).diverged") == 0.0


def test_a_box_is_pushed_and_turned_and_taken_away(playground):
    page = playground("task=free&driver=gait&paused")
    page.locator("#tool").select_option("box")
    x, y = numbers(page, "links()").reshape(-1, 7)[5, :2]
    double_click(page, x, y + 0.3)
    number, length, width, angle = numbers(page, "boxes()")
    assert (number, angle) == (0, 0.0)
    radius, *start = numbers(page, "pegs()")
    np.testing.assert_allclose([length, width], np.sqrt(2) * radius)
    drag(page, (x, y, 0.05), (x, y + 0.8, 0.05))
    steps(page, 40)
    page.mouse.up()
    _, *end = numbers(page, "pegs()")
    turned = numbers(page, "boxes()")[3]
    assert np.linalg.norm(np.subtract(end, start)) > 0.05
    assert turned != 0.0
    # Its picture stands where it is.
    corner = np.array(page.evaluate("Array.from(playground.view.boxes.instanceMatrix.array.slice(0, 14))"))
    np.testing.assert_allclose(corner[:2], length * np.array([np.cos(turned), np.sin(turned)]), atol=1e-6)
    np.testing.assert_allclose(corner[12:], end, atol=1e-6)
    x, y = end[0], end[1] + 0.1
    page.evaluate(f"playground.robot.move_peg(0, {x}, {y})")
    steps(page, 1)
    np.testing.assert_allclose(numbers(page, "pegs()")[1:], [x, y])
    np.testing.assert_allclose(numbers(page, "boxes()")[3], turned)
    double_click(page, x, y)
    assert len(numbers(page, "boxes()")) == 0


def test_a_ball_in_3d_is_carried_taken_away_and_pushed(playground):
    page = playground("model=spatial&task=free&driver=gait&paused")
    page.locator("#tool").select_option("ball")
    x, y = numbers(page, "links()").reshape(-1, 7)[5, :2]
    double_click(page, x + 0.3, y)
    page.evaluate(f"playground.robot.move_peg(0, {x - 0.3}, {y})")
    steps(page, 1)
    np.testing.assert_allclose(numbers(page, "pegs()")[1:], [x - 0.3, y])
    double_click(page, x - 0.3, y, 0.05)
    assert len(numbers(page, "balls()")) == 0
    double_click(page, x + 0.3, y)
    radius, *start = numbers(page, "pegs()")
    np.testing.assert_array_equal(numbers(page, "balls()"), [0.0, radius])
    drag(page, (x, y, 0.05), (x + 0.8, y, 0.05))
    steps(page, 40)
    page.mouse.up()
    _, *end = numbers(page, "pegs()")
    assert np.linalg.norm(np.subtract(end, start)) > 0.05
    number, height = numbers(page, "balls()")
    assert (number, height) == (0.0, pytest.approx(radius, abs=1e-4))
    # Its picture is a sphere where it is.
    shown = np.array(page.evaluate("Array.from(playground.view.balls.instanceMatrix.array.slice(0, 15))"))
    np.testing.assert_allclose(shown[[0, 5, 10]], radius)
    np.testing.assert_allclose(shown[12:], [*end, height], atol=1e-6)


def test_discs_are_pushed_and_stay_where_they_were_pushed_when_another_is_dragged(playground):
    page = playground("task=clutter&paused")
    assert len(numbers(page, "springs()")) == 0
    before = numbers(page, "pegs()").reshape(-1, 3)
    steps(page, 120)
    after = numbers(page, "pegs()").reshape(-1, 3)
    moved = np.hypot(*(after - before)[:, 1:].T)
    assert moved.max() > 0.01
    far = int(np.argmin(moved))
    page.evaluate(f"playground.robot.move_peg({far}, 8, 3)")
    dragged = numbers(page, "pegs()").reshape(-1, 3)
    np.testing.assert_array_equal(np.delete(dragged, far, 0), np.delete(after, far, 0))
    np.testing.assert_allclose(dragged[far, 1:], [8.0, 3.0])
    steps(page, 1)
    pushed = int(np.argmax(moved))
    left = numbers(page, "pegs()").reshape(-1, 3)[pushed] - after[pushed]
    assert np.hypot(*left[1:]) < 0.3 * moved.max()


def test_a_patch_of_ice_is_laid_and_taken_away(playground):
    page = playground("task=free&driver=isotropic&paused")
    observed, place = len(numbers(page, "observation()")), numbers(page, "links()")
    page.evaluate("document.getElementById('tool').value = 0.1")
    x, y = place.reshape(-1, 7)[0, :2]
    double_click(page, x + 0.25, y)
    (patch,) = page.evaluate("playground.patches")
    assert patch["factor"] == 0.1
    np.testing.assert_allclose(np.mean(patch["vertices"], axis=0), [x + 0.25, y], atol=0.02)
    np.testing.assert_array_equal(numbers(page, "links()"), place)
    assert len(numbers(page, "observation()")) == observed, "the policy goes on"
    steps(page, 40)
    on_ice = numbers(page, "links()")
    double_click(page, x + 0.5, y + 0.2)
    assert page.evaluate("playground.patches") == []
    page.evaluate("document.getElementById('restart').click()")
    steps(page, 40)
    assert page.locator("#driver").input_value() == "isotropic"
    assert np.abs(numbers(page, "links()") - on_ice).max() > 1e-3


@pytest.mark.parametrize("size", PHONES, ids=lambda size: f"{size['width']}x{size['height']}")
def test_a_phone_has_room_for_fingers(playground, size):
    page = playground("task=free&driver=gait&paused", size)
    for _ in range(2):
        assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        for one in page.locator("button:visible, select:visible, input:visible").all():
            box = one.bounding_box()
            assert min(box["width"], box["height"]) >= TOUCHED, one.get_attribute("id")
            assert box["x"] >= 0.0
            assert box["x"] + box["width"] <= size["width"]
        page.locator("#restart").tap()
        page.locator("#more").tap()
    page.wait_for_function("playground.view.height === document.getElementById('stage').clientHeight")
    links = numbers(page, "links()").reshape(-1, 7)[:, :2]
    seen = np.array([page.evaluate(f"playground.view.pixel({x}, {y}, 0)") for x, y in links])
    assert (seen > 0.0).all(), "the camera turns with the page"
    assert (seen < list(size.values())).all()
    link = links.mean(axis=0)
    x, y = page.evaluate(f"playground.view.pixel({link[0]}, {link[1] + 0.25}, 0)")
    assert 0 < x < size["width"]
    assert 0 < y < size["height"]
    touch = page.context.new_cdp_session(page)
    for phase in ("Start", "End") * 2:  # at one time, however busy the machine is
        points = [{"x": x, "y": y}] if phase == "Start" else []
        touch.send("Input.dispatchTouchEvent", {"type": f"touch{phase}", "touchPoints": points, "timestamp": 1.0})
    assert len(numbers(page, "pegs()")) == 3
    page.locator("[data-key=ArrowRight]").dispatch_event("pointerdown")
    steps(page, 1)
    assert numbers(page, "action()")[3] > 0.2
