"""The 3D crawl's own geometry against brute force, and no overlap beyond a millimetre."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.penetration_spatial import SCENES, crawl, ground_gap, peg_gap, play, self_gap, wall_gap
from snake_env import load_policy
from snake_env.evaluation import seeds

HALF, RADIUS = np.full(4, 0.04), np.full(4, 0.05)
ALONG = np.linspace(-HALF[0], HALF[0], 401)


def _robots(seed: int, robots: int = 20) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres and axes (n, 4, 3), and points (n, 4, k, 3) of the centre lines."""
    rng = np.random.default_rng(seed)
    centre, axis = rng.uniform(-0.1, 0.1, (robots, 4, 3)), rng.normal(size=(robots, 4, 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    return centre, axis, centre[:, :, None] + ALONG[:, None] * axis[:, :, None]


def test_gaps_to_pegs_and_to_the_ground_are_those_of_points_on_the_centre_line():
    centre, axis, points = _robots(0)
    rng = np.random.default_rng(1)
    pegs = np.concatenate([rng.uniform(0.01, 0.1, (20, 3, 1)), rng.uniform(-0.2, 0.2, (20, 3, 2))], axis=-1)
    away = np.linalg.norm(points[:, :, None, :, :2] - pegs[:, None, :, None, 1:], axis=-1)
    sampled = (away - 0.05 - pegs[:, None, :, None, 0]).min(axis=(1, 2, 3))
    np.testing.assert_allclose(peg_gap(centre, axis, HALF, RADIUS, list(pegs)), sampled, atol=1e-4)
    np.testing.assert_allclose(ground_gap(centre, axis, HALF, RADIUS), points[..., 2].min(axis=(1, 2)) - 0.05)


def test_gaps_to_walls_are_those_of_the_shadows():
    centre, axis, points = _robots(2)
    wall = np.array([[-0.2, -0.1], [-0.05, 0.2]])
    share = np.linspace(0, 1, 401)[:, None]
    outline = wall[0] + share * (wall[1] - wall[0])
    away = np.linalg.norm(points[:, :, ::8, None, :2] - outline, axis=-1).min(axis=(1, 2, 3))
    gap = wall_gap(centre, axis, HALF, RADIUS, [wall])
    near = away < 0.05
    assert near.sum() > 3
    np.testing.assert_allclose(gap[near], away[near] - 0.05, atol=3e-3)


def test_gaps_between_links_are_those_of_points_on_their_centre_lines():
    centre, axis, points = _robots(3)
    pairs = [(0, 2), (0, 3), (1, 3)]
    away = [
        np.linalg.norm(points[:, i, ::4, None] - points[:, j, None, ::4], axis=-1).min(axis=(1, 2)) for i, j in pairs
    ]
    gap = self_gap(centre, axis, HALF, RADIUS)
    sampled = np.min(away, axis=0) - 0.1
    near = np.isfinite(gap) & (sampled < 0)
    assert near.sum() > 10
    np.testing.assert_allclose(gap[near], sampled[near], atol=1e-3)


@pytest.mark.parametrize("mode", ["joints", "torques"])
@pytest.mark.parametrize("scene", ["maze", "walls"])
def test_random_actions_leave_less_than_a_millimetre(scene, mode):
    found = crawl(SCENES[scene] | {"model": "spatial", "action_mode": mode}, steps=400, num_envs=16)
    assert found.steps > 350
    assert max(found.overlap) < 1e-3
    assert found.beyond == found.crossings == 0


def test_a_policy_is_judged_in_each_step_of_its_episodes():
    found = play(load_policy("spatial"), seeds.held_out(2), 1)
    assert 160 < found.steps <= 2 * 160, "two episodes of 8 s, none of which ends at once"
    assert found.beyond == found.crossings == found.flagged == 0
    assert 0.0 < max(found.overlap) < 1e-3
