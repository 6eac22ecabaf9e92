"""What is told about a policy's episodes is what happened in them."""

import dataclasses
import json

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pygame")

from matplotlib.patches import FancyArrowPatch
from PIL import Image, ImageSequence

from snake_env import Scene, SnakeEnv
from snake_env.evaluation import film, rollout, seeds
from snake_env.policies import ConstantAction, GaitParameters, Network, files
from snake_env.policies.scripted.sensors import Sensors
from training import cli
from training.evaluation import inspection_figures, video
from training.evaluation.record_episodes import KINDS, RecordedPolicy, push_ahead


@pytest.fixture
def random_policy(tmp_path):
    """A network of one layer with random weights, in a file of its own."""
    rng = np.random.default_rng(0)
    arrays = {"actor.0.weight": rng.normal(0, 0.3, (4, 63)), "actor.0.bias": np.array([0.2, 1.0, 0.5, 0.0])}
    path = tmp_path / "mine.safetensors"
    options = {"difficulty": 1.0, "max_episode_steps": 60}
    files.write(path, {k: v.astype(np.float32) for k, v in arrays.items()}, {"env_id": "SnakeField-v1", "env": options})
    return path


def test_pushes_are_the_pegs_forces_along_the_way():
    """The mean force over a control period against the change of momentum and the friction, which no policy sees."""
    env = rollout.make_env("SnakeField-v1", 1, 1)
    sensors = Sensors(env.unwrapped.layout)
    observation, _ = env.reset(seed=seeds.selection(1))
    gait = GaitParameters().action(env.unwrapped.layout["action"])
    told, felt = [], []
    for _ in range(100):
        observation = env.step(gait[None])[0]
        sensors.read(observation)
        told.append(push_ahead(sensors)[0])
        felt.append(env.unwrapped.state().contact_force[0, :, 0])
    told, felt = np.array(told), np.array(felt)
    pushing = (np.abs(told) > 1.0) & (np.abs(felt) > 1.0)
    assert pushing.sum() > 20
    assert np.mean(np.sign(told[pushing]) == np.sign(felt[pushing])) > 0.95
    assert np.corrcoef(told[pushing], felt[pushing])[0, 1] > 0.8


def test_ends_are_distinguished():
    """Four robots of forty periods: one arrives, one leaves, one stands still at the end, one moves to the end."""
    watch = RecordedPolicy(ConstantAction(np.zeros(4, np.float32)))
    watch.period = 0.5
    moving, standing = np.linspace(1.0, 0.1, 40), np.maximum(np.linspace(1.0, 0.1, 40), 0.6)
    watch.remaining = list(np.stack([moving, moving, standing, moving], axis=1))
    watch.force = [np.zeros((4, 11))] * 40
    episodes = {
        "time": np.array([10.0, 5.0, 20.0, 20.0]),
        "is_success": np.array([True, False, False, False]),
        "left_corridor": np.array([False, True, False, False]),
    }
    assert list(watch.kinds(episodes, 2.0)) == [0, 1, 2, 3]
    assert list(watch.during(episodes).sum(axis=0)) == [20, 10, 40, 40]


def test_a_watched_policy_acts_as_it_does_alone(random_policy):
    policy = Network(random_policy)
    played = [
        rollout.run_episodes(one, "SnakeField-v1", seeds.selection(3), 1, max_episode_steps=60)["distance"]
        for one in (policy, RecordedPolicy(policy))
    ]
    assert np.array_equal(*played)


def test_the_command_counts_every_episode_and_shows_each_kind(random_policy, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["inspect", "--policy", str(random_policy), "--fields", "4", "--num-threads", "1", "--out", str(out)]
    assert cli.main(arguments) == 0
    found = json.loads((out / "inspection.json").read_text())
    assert set(found) == {"mine", "heading control"}
    assert all(sum(one["ends"].values()) == 4 for one in found.values())
    assert all(min(one["ahead"]) >= 0.0 >= max(one["back"]) for one in found.values())
    for one in found.values():
        low, median, high = one["wave"]["frequency"]
        assert -40.0 <= low <= median <= high <= 200.0
    assert f"{found['mine']['no_slip_speed']:.3f} without slip" in capsys.readouterr().out
    shown = sum(found["mine"]["ends"][kind] > 0 for kind in KINDS)
    assert len(list(out.glob("*-frames.png"))) == len(list(out.glob("*-timeline.png"))) == shown
    assert len(list(out.glob("*.gif"))) == shown
    assert (out / "links.png").stat().st_size > 5000


@pytest.fixture
def drawn(monkeypatch):
    """Figures that would have been saved."""
    figures = []
    monkeypatch.setattr(inspection_figures.drawing, "save", lambda figure, path: figures.append(figure))
    return figures


def test_the_panels_of_a_timeline_share_one_time_axis(random_policy, tmp_path, drawn):
    """An instant is at the same place in each, beside the colour bar too."""
    policy = Network(random_policy)
    episode = film.play(policy, "SnakeField-v1", seeds.selection(1)[0], max_episode_steps=60)
    inspection_figures.timeline(episode, rollout.layout_of("SnakeField-v1", {}), "title", tmp_path / "timeline.png")
    drawn[0].draw_without_rendering()
    pushes, gait, speed = drawn[0].axes[:3]
    for other in (gait, speed):
        assert other.get_xlim() == pushes.get_xlim()
        assert other.get_position().intervalx == pytest.approx(pushes.get_position().intervalx, abs=1e-6)


def test_an_episode_is_shown_to_its_end(random_policy):
    """The state in which it ended, too: what left the corridor is outside in the last picture."""
    policy = Network(random_policy)
    options = {"corridor_half_width": 0.1, "max_episode_steps": 400}
    episode = film.play(policy, "SnakeField-v1", seeds.selection(1)[0], render_mode="rgb_array", **options)
    last, centre_line = episode.states[-1], episode.states[-1].goal[1]
    assert len(episode.walk) == len(episode.states) == len(episode.observations) == len(episode.frames)
    np.testing.assert_allclose(np.diff([one.time for one in episode.states]), 0.05)
    assert last.time < 20.0
    assert abs(episode.walk[-1, 1] - centre_line) > 0.1 >= abs(episode.walk[-2, 1] - centre_line)


def episode_of(force, goal, goal_radius):
    """Five times the same state: eleven links in a row, the fifth of which is pushed, and a peg."""
    env = SnakeEnv(task="free", corridor_half_width=0.5)
    env.reset(seed=0)
    links = np.zeros((11, 2))
    links[:, 0] = -0.12 * np.arange(11)
    contact_force = np.zeros((11, 2))
    contact_force[4] = force
    state = dataclasses.replace(
        env.state(),
        link_position=links,
        link_angle=np.zeros(11),
        position=links.mean(0),
        contact_force=contact_force,
        goal=np.array(goal),
        goal_radius=np.array(goal_radius),
    )
    return film.Episode(None, Scene(obstacles=[(0.1, 0.0, 0.3)]), [], True, [state] * 5, None)


LINE = {"goal": (0.5, 0.1), "goal_radius": 0.0}
DISC = {"goal": (0.2, 0.1), "goal_radius": 0.25}


@pytest.mark.parametrize(("force", "newtons"), [((0.0, 10.0), "50 N"), ((-400.0, 300.0), "200 N")])
def test_arrows_of_force_end_inside_the_frame_and_have_a_scale(force, newtons, tmp_path, drawn):
    episode = episode_of(force, **LINE)
    inspection_figures.frames(episode, "title", 2, tmp_path / "frames.png")
    drawn[0].draw_without_rendering()
    for axes in drawn[0].axes:
        box = axes.get_window_extent()
        arrows = [one for one in axes.patches if isinstance(one, FancyArrowPatch)]
        assert len(arrows) == 2
        assert all(
            box.containsx(x) and box.containsy(y) for one in arrows for x, y in one.get_window_extent().corners()
        )
    assert newtons in [one.get_text() for one in drawn[0].axes[0].texts]


@pytest.mark.parametrize(("goal", "bordered"), [(LINE, True), (DISC, False)])
def test_a_legend_names_what_is_drawn(goal, bordered, tmp_path, drawn):
    episode = episode_of((0.0, 0.0), **goal)
    inspection_figures.frames(episode, "title", 2, tmp_path / "frames.png")
    names = [one.get_text() for one in drawn[0].legends[0].get_texts()]
    assert names == ["centre of gravity", "goal"] + ["border of the corridor"] * bordered
    heights = [line.get_ydata()[0] for line in drawn[0].axes[0].lines if line.get_linestyle() == "-."]
    assert heights == pytest.approx([-0.4, 0.6] if bordered else [])


def test_small_films_are_small(tmp_path):
    frames = [np.full((480, 800, 3), k, np.uint8) for k in range(30)]
    assert video.write_small_gif(frames, tmp_path / "film.gif").stat().st_size < 50_000


def test_a_small_film_has_the_same_colours_from_end_to_end(tmp_path):
    """What stands still looks the same in each picture, whatever else comes into view."""
    frames = [np.full((480, 800, 3), (238, 234, 224), np.uint8) for _ in range(31)]
    for k, frame in enumerate(frames):
        frame[:, ::71] = frame[::71] = (221, 215, 202)
        frame[200:300, 200:300] = (120, 128, 138)
        frame[300:400, 10 * k : 10 * k + 50] = (190, 40, 8 * k)
    with Image.open(video.write_small_gif(frames, tmp_path / "film.gif")) as small:
        shown = [np.asarray(one.convert("RGB")) for one in ImageSequence.Iterator(small)]
    assert len(shown) == 11
    for one in shown:
        np.testing.assert_array_equal(one[:300], shown[0][:300])
    assert len(np.unique(np.concatenate(shown).reshape(-1, 3), axis=0)) <= 24
    assert len(np.unique(shown[0][:180].reshape(-1, 3), axis=0)) > 1
