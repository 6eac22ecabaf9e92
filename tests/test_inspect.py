"""What is told about a policy's episodes is what happened in them."""

import json

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pygame")

from training import inspect_figures, inspect_policy, policies, policy_file, rollout, seeds, video
from training.baselines.senses import Senses
from training.watch import KINDS, Watch, push_ahead


@pytest.fixture
def random_policy(tmp_path):
    """A network of one layer with random weights, in a file of its own."""
    rng = np.random.default_rng(0)
    arrays = {"actor.0.weight": rng.normal(0, 0.3, (4, 63)), "actor.0.bias": np.array([0.2, 1.0, 0.5, 0.0])}
    path = tmp_path / "mine.safetensors"
    options = {"difficulty": 1.0, "max_episode_steps": 60}
    policy_file.write(
        path, {k: v.astype(np.float32) for k, v in arrays.items()}, {"env_id": "SnakeField-v0", "env": options}
    )
    return path


def test_pushes_are_the_pegs_forces_along_the_way():
    """The mean force over a control period against the change of momentum and the friction, which no policy sees."""
    env = rollout.make_env("SnakeField-v0", 1, 1)
    senses = Senses(env.unwrapped.layout)
    observation, _ = env.reset(seed=seeds.selection(1))
    gait = policies.GaitParameters().action(env.unwrapped.layout["action"])
    told, felt = [], []
    for _ in range(100):
        observation = env.step(gait[None])[0]
        senses.see(observation)
        told.append(push_ahead(senses)[0])
        felt.append(np.array(env.unwrapped._robots.native.snapshot(0)["contact_force"])[:, 0])
    told, felt = np.array(told), np.array(felt)
    pushing = (np.abs(told) > 1.0) & (np.abs(felt) > 1.0)
    assert pushing.sum() > 20
    assert np.mean(np.sign(told[pushing]) == np.sign(felt[pushing])) > 0.95
    assert np.corrcoef(told[pushing], felt[pushing])[0, 1] > 0.8


def test_ends_are_told_apart():
    """Four robots of forty periods: one arrives, one leaves, one stands still at the end, one moves to the end."""
    watch = Watch(policies.ConstantAction(np.zeros(4, np.float32)))
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
    policy = policies.Network(random_policy)
    played = [
        rollout.run_episodes(one, "SnakeField-v0", seeds.selection(3), 1, max_episode_steps=60)["distance"]
        for one in (policy, Watch(policy))
    ]
    assert np.array_equal(*played)


def test_the_command_counts_every_episode_and_shows_each_kind(random_policy, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["--policy", str(random_policy), "--fields", "4", "--num-threads", "1", "--out", str(out)]
    assert inspect_policy.main(arguments) == 0
    found = json.loads((out / "inspection.json").read_text())
    assert set(found) == {"mine", "heading control"}
    assert all(sum(one["ends"].values()) == 4 for one in found.values())
    assert all(min(one["ahead"]) >= 0.0 >= max(one["back"]) for one in found.values())
    shown = sum(found["mine"]["ends"][kind] > 0 for kind in KINDS)
    assert len(list(out.glob("*-frames.png"))) == len(list(out.glob("*-timeline.png"))) == shown
    assert len(list(out.glob("*.gif"))) == shown
    assert (out / "links.png").stat().st_size > 5000


def test_the_panels_of_a_timeline_share_one_time_axis(random_policy, tmp_path, monkeypatch):
    """An instant is at the same place in each, beside the colour bar too."""
    drawn = []
    monkeypatch.setattr(inspect_figures.drawing, "save", lambda figure, path: drawn.append(figure))
    policy = policies.Network(random_policy)
    episode = video.play(policy, "SnakeField-v0", seeds.selection(1)[0], max_episode_steps=60)
    inspect_figures.timeline(episode, rollout.layout_of("SnakeField-v0", {}), "title", tmp_path / "timeline.png")
    drawn[0].draw_without_rendering()
    pushes, gait, speed = drawn[0].axes[:3]
    for other in (gait, speed):
        assert other.get_xlim() == pushes.get_xlim()
        assert other.get_position().intervalx == pytest.approx(pushes.get_position().intervalx, abs=1e-6)


def test_small_films_are_small(tmp_path):
    frames = [np.full((480, 800, 3), k, np.uint8) for k in range(30)]
    assert video.write_small_gif(frames, tmp_path / "film.gif").stat().st_size < 50_000
