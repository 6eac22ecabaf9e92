"""Following the leader: chains lie on their tracks, forces balance, tracks keep clear, and a robot gets there."""

import numpy as np
import pytest

from snake_env.evaluation import rollout, seeds
from snake_env.policies.gaits import DEGREE
from snake_env.policies.scripted import grip
from snake_env.policies.scripted.chain import Link, middles, shifted, touch, unit
from snake_env.policies.scripted.follow import NEAR, PEGS, FollowTheLeader
from snake_env.policies.scripted.planner import CLEARANCE, DEPTH, Planner, Wishes

AIKO = Link(0.122, 0.0393, 0.0525)
LINKS = 11
VALUES = {
    "speed": 0.2,
    "bend": 50 * DEGREE,
    "slack": 0.03,
    "grip": 10.0,
    "straight": 1.0,
    "trust": 0.3,
    "amplitude": 45 * DEGREE,
    "omega": 140 * DEGREE,
    "beta": -32 * DEGREE,
    "steering": 0.3,
    "look_ahead": 1.0,
}
SPREAD = np.random.default_rng(5)


def started(env_id="SnakeCourse-v1", num_envs=3, **options):
    """A controller that has seen the first observation of robots."""
    policy = FollowTheLeader(VALUES)
    env = rollout.make_env(env_id, num_envs, 1, **policy.env_options, **options)
    observation, _ = env.reset(seed=seeds.selection(num_envs))
    policy.begin(env.unwrapped.layout, num_envs)
    policy.sensors.read(observation)
    return policy, env, observation


def planned(policy):
    """Bodies (2, links, n), directions (links, n), pegs (3, k, n) and the turns (DEPTH, n) ahead."""
    n = policy.num_envs
    direction = policy.sensors.link_directions.T
    middle, pegs = middles(direction, AIKO.length), policy.sensors.pegs
    wishes = Wishes(*(np.full(n, VALUES[name]) for name in ("bend", "slack", "grip", "straight")))
    turns, lack = Planner(AIKO, wishes, pegs).plan(middle, direction, np.zeros(n))
    return middle, direction, pegs, turns, lack


def ahead(direction, turns):
    """Middles (2, DEPTH, n) and directions (DEPTH, n) of the pieces of a track, the nearest first."""
    angle = direction[0] - np.cumsum(turns[::-1], axis=0)
    along = unit(np.concatenate([direction[:1], angle]))
    steps = 0.5 * AIKO.length * (along[:, 1:] + along[:, :-1])
    return np.cumsum(steps, axis=1), angle


def test_links_of_a_chain_meet_in_joints_and_have_their_length():
    direction = SPREAD.uniform(-3.0, 3.0, (LINKS, 4))
    middle, half = middles(direction, AIKO.length), 0.5 * AIKO.length * unit(direction)
    np.testing.assert_allclose((middle - half)[:, :-1], (middle + half)[:, 1:], atol=1e-15)
    np.testing.assert_array_equal(middle[:, 0], 0.0)


def test_a_body_that_has_moved_by_whole_links_lies_on_the_track():
    turns = SPREAD.uniform(-1.0, 1.0, (2, 20))
    np.testing.assert_array_equal(shifted(turns, np.array([0.0, 3.0]), 10)[0], turns[0, 10:])
    np.testing.assert_array_equal(shifted(turns, np.array([0.0, 3.0]), 10)[1], turns[1, 7:17])


def test_between_whole_links_its_joints_lie_near_the_track():
    """Chords of the length of a link in a polygon with corners of 15 degrees, against linear angles."""
    bend, share = 15 * DEGREE, np.linspace(0.0, 1.0, 11)
    turns = np.array([[bend, 0.0, 0.0]])
    # The chord from a piece to the next one, cut by the corner into parts (1 - s) and s.
    exact = np.arctan2(share * np.sin(bend), 1.0 - share + share * np.cos(bend))
    linear = [shifted(turns, np.array([part]), 2)[0, 0] for part in share]
    np.testing.assert_allclose(linear, exact, atol=0.002)


def test_the_track_ends_where_it_ends():
    turns = SPREAD.uniform(-1.0, 1.0, (1, 12))
    np.testing.assert_array_equal(shifted(turns, np.array([50.0]), 10), turns[:, :10])


def test_gaps_are_distances_between_links_and_pegs():
    """Against the nearest of many points of a link's centre line."""
    middle, angle = SPREAD.normal(0.0, 0.2, (2, 50)), SPREAD.uniform(-3.0, 3.0, 50)
    pegs = np.stack([*SPREAD.normal(0.0, 0.2, (2, 50)), SPREAD.uniform(0.02, 0.1, 50)])
    along = unit(angle)
    found = touch(middle, along, pegs, AIKO)
    points = middle[..., None] + np.linspace(-AIKO.half, AIKO.half, 2001) * along[..., None]
    distance = np.hypot(*(points - pegs[:2, :, None])).min(axis=-1)
    np.testing.assert_allclose(found.gap, distance - pegs[2] - AIKO.radius, atol=1e-4)
    np.testing.assert_allclose(
        np.hypot(*(found.point + found.out * -1.0 * (found.gap + pegs[2] + AIKO.radius) - pegs[:2])), 0.0, atol=1e-9
    )


def push(point, force):
    """A push as a column (3, 1)."""
    return grip.wrench(np.array(point, float)[:, None], np.array(force, float)[:, None])


def test_nothing_is_balanced_without_pegs_or_by_pegs_that_push_back():
    friction = np.array([-1.0, 0.0, 0.0])
    assert grip.shortfall(friction, np.zeros((3, 5))) == 1.0
    assert grip.shortfall(friction, push((0.0, 0.0), (-0.6, 0.8))) == 1.0


def test_three_push_points_balance_friction_and_two_do_not():
    """Pegs on alternating sides of a wave, each pushing ahead and to its own side; two leave a moment."""
    friction = np.array([-1.0, 0.0, 0.0])
    three = np.concatenate(
        [push((-0.4, 0.0), (0.6, 0.8)), push((0.0, 0.0), (0.6, -0.8)), push((0.4, 0.0), (0.6, 0.8))], axis=1
    )
    assert grip.shortfall(friction, three) < 0.2
    assert grip.shortfall(friction, three[:, :2]) > 0.35


def test_a_straight_body_has_no_grip():
    """Pegs push across it, friction pulls along it."""
    middle = middles(np.zeros((LINKS, 1)), AIKO.length)
    friction = -grip.wrench(middle, unit(np.zeros((LINKS, 1)))).mean(axis=1)
    sides = np.concatenate([push((-0.1 * k, 0.0), (0.0, (-1.0) ** k)) for k in range(6)], axis=1)
    assert grip.shortfall(friction[:, 0], sides) == 1.0


def test_tracks_on_the_course_keep_clear_and_bend_no_more_than_joints_may():
    _, direction, pegs, turns, _ = planned(started()[0])
    middle, angle = ahead(direction, turns)
    gap = touch(middle[:, None], unit(angle)[:, None], pegs[:, :, None], AIKO).gap
    assert turns.shape == (DEPTH, 3)
    assert gap.min() > -2.0 * CLEARANCE
    assert np.abs(turns).max() <= VALUES["bend"] + 1e-12


def test_tracks_on_the_course_pass_pegs_on_alternating_sides_with_a_grip():
    _, direction, pegs, turns, lack = planned(started()[0])
    middle, angle = ahead(direction, turns)
    found = touch(middle[:, None], unit(angle)[:, None], pegs[:, :, None], AIKO)
    left = unit(angle + 0.5 * np.pi)
    for robot in range(3):
        near = np.flatnonzero(found.gap[..., robot].min(axis=1) < VALUES["slack"])
        near = near[np.argsort(pegs[0, near, robot])]
        piece = found.gap[near, :, robot].argmin(axis=1)
        side = np.sign((found.out[:, near, piece, robot] * left[:, piece, robot]).sum(axis=0))
        assert len(near) >= 2
        assert np.all(side[1:] == -side[:-1])
    assert lack[-NEAR:].mean(axis=0).max() < VALUES["trust"]


def test_located_pegs_are_where_they_are():
    """Against the scene of the simulation, which no policy sees."""
    policy, env, _ = started(num_envs=1)
    seen = policy.sensors.pegs[..., 0]
    radius, x, y = np.array(env.unwrapped.scene(0).obstacles).T
    at = env.unwrapped.state().link_position[0, 0]
    for peg in seen[:, seen[0] < 10.0].T:
        assert np.hypot(x - at[0] - peg[0], y - at[1] - peg[1]).min() < 1e-5
        assert peg[2] == pytest.approx(radius[0], abs=1e-5)
    assert policy.sensors.size("pegs") == 3 * PEGS


def test_where_there_is_no_grip_a_wave_goes_on_from_the_bend_at_the_head():
    policy, env, observation = started()
    block = next(block for block in env.unwrapped.layout["observation"] if block["name"] == "pegs")
    unseen = observation.copy()
    unseen[:, block["start"] : block["start"] + block["size"]] = 0.0
    policy(unseen)
    wave, body = policy._turns[:, :DEPTH], policy._turns[:, DEPTH:]
    assert np.abs(wave).max() > 0.9 * VALUES["amplitude"]
    assert np.abs(wave[:, -1] - body[:, 0]).max() < VALUES["amplitude"] * np.abs(VALUES["beta"]) + 10 * DEGREE


def test_a_robot_follows_its_head_through_the_course_and_repeats_itself():
    def played():
        return rollout.run_episodes(FollowTheLeader(VALUES), "SnakeCourse-v1", seeds.selection(2), 1)

    first, again = played(), played()
    assert first["is_success"].all()
    assert all(np.array_equal(first[name], again[name], equal_nan=True) for name in first)
