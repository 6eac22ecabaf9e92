"""The crawl's own geometry against brute force, and no overlap beyond a millimetre."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.penetration import (
    ACTION_MODES,
    SCENES,
    chain,
    crawl,
    interpolated,
    passed_through,
    peg_gap,
    play,
    self_gap,
    wall_gap,
)
from snake_env.evaluation import rollout, seeds, tasks
from snake_env.policies.shipped import load_policy

HALF, RADIUS = np.full(4, 0.04), np.full(4, 0.05)


def _line(pose: np.ndarray, points: int = 2001) -> np.ndarray:
    """Points of a centre line."""
    along = np.linspace(-HALF[0], HALF[0], points)
    return pose[:2] + along[:, None] * [np.cos(pose[2]), np.sin(pose[2])]


def _poses(rng: np.random.Generator, robots: int) -> np.ndarray:
    return np.concatenate([rng.uniform(-0.1, 0.1, (robots, 4, 2)), rng.uniform(-4, 4, (robots, 4, 1))], axis=-1)


def test_gaps_to_pegs_are_those_of_points_on_the_centre_line():
    rng = np.random.default_rng(0)
    poses = _poses(rng, 20)
    pegs = np.concatenate([rng.uniform(0.01, 0.1, (20, 3, 1)), rng.uniform(-0.2, 0.2, (20, 3, 2))], axis=-1)
    for gap, links, circles in zip(peg_gap(poses, HALF, RADIUS, pegs), poses, pegs, strict=True):
        sampled = [
            np.linalg.norm(_line(link) - peg[1:], axis=1).min() - 0.05 - peg[0] for link in links for peg in circles
        ]
        assert min(0.0, *sampled) == pytest.approx(min(0.0, gap), abs=1e-6)


def test_gaps_to_walls_are_those_of_points_on_the_centre_line():
    rng = np.random.default_rng(2)
    poses = _poses(rng, 20)
    triangle = np.array([[0.05, 0.0], [0.2, 0.02], [0.1, 0.15]])
    wall = np.array([[-0.2, -0.1], [-0.05, 0.2]])

    def outline(corners):
        share = np.linspace(0, 1, 401)[:, None]
        sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        return np.concatenate([start + share * (end - start) for start, end in sides])

    for gap, links in zip(wall_gap(poses, HALF, RADIUS, [triangle, wall]), poses, strict=True):
        sampled = []
        for link in links:
            line = _line(link, 401)
            for corners in (triangle, wall):
                away = np.linalg.norm(line[:, None] - outline(corners), axis=-1).min()
                middle = corners.mean(axis=0)
                hidden = len(corners) > 2 and np.linalg.norm(line - middle, axis=1).min() < 0.02
                sampled.append((0.0 if hidden else away) - 0.05)
        assert max(-0.05, min(0.0, *sampled)) == pytest.approx(max(-0.05, min(0.0, gap)), abs=1e-3)


def test_a_chain_is_interpolated_with_closed_joints():
    """A chain that turns by half a turn about its middle, and on the way is where a rotation takes it."""
    angle = np.full((1, 4), 0.3)
    first = np.concatenate([chain(np.stack([np.cos(angle), np.sin(angle)], axis=-1), 0.06), angle[..., None]], axis=-1)
    last = first * [-1, -1, 1] + [0, 0, np.pi]
    for share, turn in ((0.0, 0.0), (0.25, 0.25 * np.pi), (1.0, np.pi)):
        between = interpolated(first, last, share)
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        np.testing.assert_allclose(between[..., :2], first[..., :2] @ rotation.T, atol=1e-12)
        np.testing.assert_allclose(between[..., 2], 0.3 + turn)


def test_links_that_pass_through_something_are_found_and_those_that_swing_beside_it_are_not():
    half, radius = np.full(3, 0.04), np.full(3, 0.05)
    wall = [np.array([[-1.0, 0.0], [1.0, 0.0]])]
    no_pegs = np.empty((1, 0, 3))

    def straight(y, angle):
        along = 0.12 * (np.arange(3) - 1)
        return np.stack([along * np.cos(angle), y + along * np.sin(angle), np.full(3, angle)], axis=-1)[None]

    below, above, beyond = straight(-0.1, 0.0), straight(0.1, 0.0), straight(0.25, 0.0)
    assert passed_through(below, above, half, radius, no_pegs, wall)
    assert not passed_through(above, beyond, half, radius, no_pegs, wall)
    # The last link swings by half a turn beside the wall: on the way of a steady turn it is 3 cm inside.
    angles = np.array([[0.0, 0.0, -0.3], [0.0, 0.0, -np.pi + 0.3]])[..., None]
    hanging = chain(np.concatenate([np.cos(angles), np.sin(angles)], axis=-1), 0.06) + np.array([0.0, 0.095])
    first, last = np.concatenate([hanging, angles], axis=-1)[:, None]
    middle = wall_gap(interpolated(first, last, 0.5), half, radius, wall)
    assert -0.9 * 0.05 < middle[0] < -0.5 * 0.05
    assert not passed_through(first, last, half, radius, no_pegs, wall)
    peg = np.array([[[0.05, 0.0, 0.0]]])
    assert passed_through(below, above, half, radius, peg, [])
    assert not passed_through(above, beyond, half, radius, peg, [])


def test_gaps_between_links_are_those_of_points_on_their_centre_lines():
    rng = np.random.default_rng(1)
    poses = _poses(rng, 20)
    for gap, links in zip(self_gap(poses, HALF, RADIUS), poses, strict=True):
        lines = [_line(link, 201) for link in links]
        pairs = [(0, 2), (0, 3), (1, 3)]
        sampled = [np.linalg.norm(lines[i][:, None] - lines[j], axis=-1).min() - 0.1 for i, j in pairs]
        assert min(0.0, *sampled) == pytest.approx(min(0.0, gap), abs=4e-4)


@pytest.mark.parametrize("mode", ACTION_MODES)
@pytest.mark.parametrize("scene", ["course", "maze", "walls"])
def test_random_actions_leave_less_than_a_millimetre(scene, mode):
    found = crawl(SCENES[scene] | {"action_mode": mode}, steps=2000, num_envs=32)
    assert found.steps > 1900
    assert max(found.overlap) < 1e-3
    assert found.beyond == found.crossings == 0


def test_a_policy_is_judged_at_every_control_instant_of_its_episodes():
    """As many steps as the episodes have, no overlap beyond a millimetre."""
    task = tasks.load()["course"]
    policy = load_policy("general")
    fields = seeds.selection(4)
    found = play(policy, task, fields, 1)
    episodes = rollout.run_episodes(policy, task.env_id, fields, 1, **task.options)
    assert found.steps == round(episodes["time"].sum() / 0.05)
    assert 0.0 < found.overlap[0] < 1e-3
    assert found.beyond == found.crossings == 0
