"""What the page of the viewer takes from outside: requests, values, choices; it survives what it refuses."""

from __future__ import annotations

import contextlib
import http.client
import math
import re
import time

import numpy as np
import pytest
from conftest import running

pytest.importorskip("viser")

import msgspec
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import snake_env
from snake_env import ConfigError
from snake_env.evaluation import tasks
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.gaits import GaitPolicy
from snake_env.viewer import gate, live, player
from snake_env.viewer.controls import place
from snake_env.viewer.frames import Frames

SHORT = BenchmarkTask("short", "SnakeFree-v1", {"max_episode_steps": 3}, "three steps")
NEAR = BenchmarkTask("near", "SnakeFree-v1", {"goal_distance": 0.1, "friction": (0.05, 0.5)}, "")


@pytest.fixture
def page(monkeypatch):
    """Makes pages whose episodes follow each other at once, and are fast."""
    monkeypatch.setattr(live, "PAUSE", 0.05)
    with contextlib.ExitStack() as made:

        def make(task=SHORT, policy="gait"):
            found = made.enter_context(running(live.Live(task, policy, port=0)))
            found.speed.value = 4.0
            return found

        yield make


def wait_until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


def goes_on(found, episodes=2):
    """So many further episodes begin."""
    for _ in range(episodes):
        time.sleep(0.1)
        begun = found._env
        wait_until(lambda begun=begun: found._env is not begun)
    assert found._thread.is_alive()


def port(found):
    return found.server.get_port()


def status(found, **headers):
    """Of the answer to a request for the page."""
    asked = http.client.HTTPConnection("127.0.0.1", port(found), timeout=10)
    asked.putrequest("GET", "/", skip_host=True)
    for name, value in headers.items():
        asked.putheader(name, value.format(port=port(found)))
    asked.endheaders()
    return asked.getresponse().status


@pytest.mark.parametrize(
    "host", ["127.0.0.1:{port}", "localhost:{port}", "localhost:9000", "[::1]:{port}", "LOCALHOST"]
)
def test_this_machine_may_open_the_page(page, host):
    found = page()
    assert status(found, Host=host) == 200
    assert status(found, Host=host, Origin=f"http://{host}") == 200


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Host": "evil.example"},
        {"Host": "evil.example:{port}"},
        {"Host": "localhost.evil.example:{port}"},
        {"Host": "127.0.0.1.evil.example"},
        {"Host": "localhost@evil.example"},
        {"Host": "8.8.8.8:{port}"},
        {"Host": "[::1"},
        {"Host": ""},
        {"Host": "localhost:{port}", "Origin": "http://evil.example"},
        {"Host": "localhost:{port}", "Origin": "https://localhost:{port}"},
        {"Host": "localhost:{port}", "Origin": "http://localhost:3000"},
        {"Host": "localhost:{port}", "Origin": "http://127.0.0.1:{port}"},
        {"Host": "localhost:{port}", "Origin": "null"},
        {"Host": "localhost:{port}", "Origin": ""},
    ],
)
def test_no_other_may(page, headers):
    assert status(page(), **headers) in (400, 403)


def socket(found, origin=None):
    protocol = [f"viser-v{viser.__version__}"]
    return connect(f"ws://localhost:{port(found)}", origin=origin, subprotocols=protocol, compression=None)


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:3000"])
def test_other_pages_cannot_drive_the_robot(page, origin):
    found = page()
    with pytest.raises(InvalidStatus, match="403"):
        socket(found, origin)
    with socket(found, f"http://localhost:{port(found)}") as own:
        assert own.recv(timeout=20)


def test_players_are_guarded_too():
    run = snake_env.simulate(duration=0.2, sample=0.1)
    with running(player.Player(Frames.of_trajectory(run), port=0)) as found:
        assert status(found, Host="evil.example") == 403
        assert status(found, Host="localhost") == 200
        for value in (math.nan, math.inf, 0.0, -1.0):
            found.speed._handle.value = value
            found.time._handle.value = value
            time.sleep(0.1)
        assert found._thread.is_alive()
        assert found.speed.value == 1.0


def test_an_interface_that_others_reach_takes_addresses_and_its_own_name():
    class Headers:
        def __init__(self, host):
            self.host = host

        def get_all(self, name):
            return [self.host] if name == "Host" else []

    for host in ("192.168.1.5:8080", "[fe80::1]", "localhost", "10.0.0.1"):
        assert gate.admits(Headers(host), "0.0.0.0")
    assert not gate.admits(Headers("evil.example"), "0.0.0.0")
    assert gate.admits(Headers("robots.lab"), "robots.lab")
    assert not gate.admits(Headers("192.168.1.5:8080"), "localhost")


def test_a_viser_that_cannot_be_guarded_is_not_used(monkeypatch):
    closed = []
    monkeypatch.setattr(player.viser, "ViserServer", lambda **_: "a server of another kind")
    monkeypatch.setattr(player, "close", closed.append)
    with pytest.raises(RuntimeError, match="answers everybody"):
        player.server(port=0)
    assert closed == ["a server of another kind"]


HOSTILE = [
    {"value": math.nan},
    {"value": math.inf},
    {"value": -1e300},
    {"value": 0},
    {"value": "../../etc/passwd"},
    {"value": "nan"},
    {"value": []},
    {"value": None},
    {"value": {"a": 1}},
    {"value": 10**18},
    {"min": -1e9, "max": 1e9, "value": 1e8},
    {"options": ["../../etc/passwd"], "value": "../../etc/passwd"},
    {"is_button": True},
]


def test_values_that_a_control_does_not_offer_change_nothing(page):
    found = page()
    found.goes_on.value = False  # the number of the scene stays
    controls = [
        found.playing,
        found.goes_on,
        found.camera.following,
        *found._choices,
        found.speed,
        found.obstacle,
        found.link,
    ]
    controls += found._sliders.values()
    before = {one: one.value for one in controls}
    for updates in HOSTILE:
        with socket(found) as hostile:
            for one in controls:
                message = {"type": "GuiUpdateMessage", "uuid": one._handle._impl.uuid, "updates": updates}
                hostile.send(msgspec.msgpack.encode(message))
            with contextlib.suppress(TimeoutError, ConnectionClosed):
                while hostile.recv(timeout=0.05):
                    pass
        for one in controls:
            assert one._admits(one.value), (updates, one.value)
            assert one.value == before[one] or type(before[one]) is not str, (updates, one.value)
        found.playing.value = True
    assert found.speed.value == 4.0
    goes_on(found)
    assert "passwd" not in found.note.content


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, 1e9])
def test_no_speed_ends_the_simulation(page, value):
    found = page()
    found.speed.value = value
    found.speed._handle.value = value
    goes_on(found)
    assert 0.1 <= found.speed.value <= 4.0


@pytest.mark.parametrize(
    ("name", "value"),
    [("policy", "spatial"), ("policy", "spatial-field")],
)
def test_a_refused_choice_goes_back_and_the_page_lives_on(page, name, value):
    found = page()
    control = getattr(found, name)
    before, env = control.value, found._env
    with found._lock:
        control.value = value
        assert control.value == before
        assert control._handle.value == before
        assert found._env is env, "the episode goes on"
        assert "expected" in found.note.content
    goes_on(found)


def test_a_policy_that_is_refused_at_its_first_observation_changes_nothing(page, monkeypatch):
    """It has been given the observation of another episode, which the running policy must not see."""
    found = page(tasks.load()["course"], "general")

    def refuse(*_):
        raise ConfigError("observation", "112 numbers", "115")

    with found._lock:
        before = found._observation
        monkeypatch.setattr(GaitPolicy, "begin", refuse)
        found.policy.value = "gait"
        assert found._observation is before
        assert "112" in found.note.content
    monkeypatch.undo()
    goes_on(found)


def test_a_refused_pair_is_refused_from_either_side(page):
    found = page(tasks.load()["spatial-open"], "spatial")
    found.task.value = "maze"
    assert (found.task.value, found.policy.value) == ("spatial-open", "spatial")
    assert "expected" in found.note.content
    found.policy.value = "gait"
    found.task.value = "maze"
    found.policy.value = "general"
    assert (found.task.value, found._actor.name) == ("maze", "general")


def test_an_error_of_the_simulation_pauses_the_page(page, monkeypatch):
    found = page()

    def fail(_):
        raise FloatingPointError("the robot is gone")

    with found._lock:
        monkeypatch.setattr(found, "_actor", fail)
    wait_until(lambda: not found.playing.value)
    assert "the robot is gone" in found.note.content
    found._again(forget=False)
    found.playing.value = True
    goes_on(found)


def test_a_goal_that_was_reached_is_shown(page):
    found = page(NEAR)
    wait_until(lambda: "goal reached" in found.note.content)
    begun = found._env
    wait_until(lambda: found._env is not begun)
    assert "goal reached" in found.note.content, "also while the next episode runs"
    found.task.value = "maze"
    assert "goal reached" not in found.note.content


def test_episodes_are_on_one_scene_after_another_and_are_counted(page):
    found = page(NEAR)
    goes_on(found)
    assert found.scene.value >= 2
    counted = re.search(r"goals (\d+) of (\d+)", found.status.content)
    assert int(counted[1]) == int(counted[2]) >= 2
    assert re.match(r"\*\*[\d.]+ s\*\* · -?[\d.]+ m · -?[\d.]+ m/s · ", found.status.content)
    found.goes_on.value = False
    found.task.value = "maze"
    assert "goals 0 of 0" in found.status.content
    with found._lock:
        scene = found.scene.value
        found._goes_on()
        assert found.scene.value == scene


def test_the_robot_rests_at_the_goal_before_it_starts_again(page, monkeypatch):
    monkeypatch.setattr(live, "PAUSE", 1.0)
    found = page(SHORT)
    wait_until(lambda: "episode over" in found.note.content)
    state, env = found.state, found._env
    time.sleep(0.5)
    assert found.state is state
    assert found._env is env
    goes_on(found, 1)


def test_in_3d_the_sliders_begin_with_the_default_gait(page):
    found = page(tasks.load()["spatial-open"])
    np.testing.assert_allclose(found._actor.action, 0.0, atol=1e-7)
    assert found.amplitude.value == 30.0
    found.amplitude.value = 35.0
    assert np.flatnonzero(np.abs(found._actor.action) > 1e-7).tolist() == [0], "it still lifts"


@pytest.mark.parametrize(
    "value",
    [(math.nan, 0, 0), (math.inf, 0, 0), (1e300, 0, 0), (0, 0), (0, 0, 0, 0), "abc", None, [[1, 2, 3]], (1, "x", 3)],
)
def test_places_that_are_none_move_nothing(page, value):
    assert place(value) is None
    found = page(tasks.load()["course"])
    found.playing.value = False
    found.obstacle.value, found.link.value = 1, 6
    before = found._env
    found._pull._is_dragged = True
    found._pull._handle._impl.position = value
    found._handle._impl.position = value
    for callback in found._handle._impl_aux.update_cb:
        callback(type("Event", (), {"phase": "end"}))
    found.advance(2)
    assert found._env is before
    assert np.isfinite(found.state.link_position).all()
