"""How deep do links of the 3D model penetrate pegs, the ground and each other under random actions?

    python -m experiments.penetration_spatial
    python -m experiments.penetration_spatial --action-modes joints --steps 300000
    python -m experiments.penetration_spatial --policies spatial   # in its own environment

The 3D companion of :mod:`experiments.penetration`: overlaps at every control instant, computed from the published poses
by the formulas below, which share nothing with the simulator. Links are capsules, pegs and walls vertical cylinders and
prisms without end; what touches the ground are the end spheres. Between two instants the chain is interpolated, and a
link that is then deep inside a peg or another link, or has its centre line on a wall, has passed through it. Steps in
which a robot is flagged do not count; their number is printed. Prints a table in Markdown.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from experiments.crawl import Crawl
from experiments.crawl import crawl as random_crawl
from experiments.crawl import play as play_episodes
from experiments.penetration import (
    ACTION_MODES,
    BETWEEN,
    CLOSELY,
    CROSSED,
    ON_THE_WALL,
    arm_of,
    chain,
    smallest_radius,
    walls_to_line,
)
from snake_env import Scene, SnakeVectorEnv
from snake_env.evaluation import seeds
from snake_env.markdown import table
from snake_env.obstacles import Box, Polygon, Segment, circles, outlines
from snake_env.policies.network import Network
from snake_env.policies.shipped import load_policy
from training.cli import answer
from training.config import Count, Seed

Array = NDArray[np.float64]

ROOM = Scene(
    obstacles=[
        Segment((-0.35, -2.2), (-0.35, 1.6)),
        Segment((0.35, -2.2), (0.35, 0.9)),
        Segment((0.35, 0.9), (-0.35, 1.6)),  # with the first, a corner of 45 degrees
        Segment((-0.35, -2.2), (0.35, -2.2)),
        Box((0.2, 0.2), 0.3, 0.35, angle=0.5),
        Polygon(((-0.35, 0.2), (-0.35, 0.5), (-0.2, 0.35))),
        (0.1, -0.1, 0.8),
    ],
    friction=(0.2, 0.5),
)
"""Walls and corners, a box and a peg around the robot, which lies along y."""

SCENES: dict[str, dict[str, Any]] = {
    "free": {"task": "free"},
    "course": {"task": "course"},
    "field": {"task": "field", "difficulty": 1.0},
    "perturbed": {"task": "perturbed", "difficulty": 1.0},
    "maze": {"task": "maze", "difficulty": 0.5},
    "corridor": {"task": "corridor", "difficulty": 0.5},
    "walls": {"task": "free", "scene": ROOM},
}


@dataclass
class Options:
    """What is measured.

    Args:
        scenes: Names.
        action_modes: "gait", "joints", "residual", "velocities" or "torques".
        steps: Robot-steps in each action mode, shared by the scenes.
        num_envs: Robots per batch.
        num_threads: Threads of the simulator.
        seed: Of scenes and actions.
        policies: Instead of random actions, shipped policies or files, each in the environment of its training.
        starts: Test scenes that these play, one episode each.
    """

    scenes: tuple[str, ...] = tuple(SCENES)
    action_modes: tuple[str, ...] = ACTION_MODES
    steps: Count = 20_000
    num_envs: Count = 128
    num_threads: int | None = None
    seed: Seed = 0
    policies: tuple[str, ...] = ()
    starts: Count = 40


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, _run, __doc__, arguments)


def _run(options: Options) -> int:
    head = [
        "actions",
        "scene",
        "steps",
        "peg [mm]",
        "wall [mm]",
        "ground [mm]",
        "self [mm]",
        "> 1 mm",
        "crossings",
        "flagged",
    ]
    print(table(head, _policy_rows(options) if options.policies else _rows(options)))
    return 0


def _policy_rows(options: Options) -> Iterator[list[str]]:
    for name in options.policies:
        policy = load_policy(name)
        found = play(policy, seeds.held_out(options.starts), options.num_threads)
        yield _row(name, policy.card.env_id, found)


def _row(actions: str, scene: str, found: Crawl) -> list[str]:
    print(actions, scene, found, file=sys.stderr, flush=True)
    overlaps = [f"{1e3 * depth:.3f}" for depth in found.overlap]
    counts = [str(count) for count in (found.beyond, found.crossings, found.flagged)]
    return [actions, scene, str(found.steps), *overlaps, *counts]


def _rows(options: Options) -> Iterator[list[str]]:
    for mode in options.action_modes:
        for scene in options.scenes:
            keywords = SCENES[scene] | {"model": "spatial", "action_mode": mode}
            steps = options.steps // len(options.scenes)
            found = crawl(keywords, steps, options.num_envs, options.num_threads, options.seed)
            yield _row(mode, scene, found)


def crawl(
    keywords: dict[str, Any], steps: int, num_envs: int = 128, num_threads: int | None = None, seed: int = 0
) -> Crawl:
    """Random actions for about ``steps`` robot-steps in the environment of these keywords."""
    envs = SnakeVectorEnv(num_envs=num_envs, num_threads=num_threads, **keywords)
    return random_crawl(envs, _Bodies, steps, seed)


def play(policy: Network, starts: list[int], num_threads: int | None = None) -> Crawl:
    """A policy's first episodes of these seeds, judged at every control instant."""
    envs = cast(SnakeVectorEnv, policy.make_vec(len(starts), num_threads=num_threads, autoreset_mode="Disabled"))
    return play_episodes(envs, _Bodies, policy, starts)


class _Bodies:
    """Centre lines, shapes and pegs of all robots, and the walls, which are the same for all."""

    def __init__(self, envs: SnakeVectorEnv) -> None:
        self._envs = envs
        self.pegs = [np.empty((0, 3))] * envs.num_envs
        self.walls: list[Array] = []
        self.centre = self.axis = np.empty((0, 0, 3))
        self.read(np.ones(envs.num_envs, dtype=bool))

    def read(self, moved: NDArray[np.bool_]) -> None:
        """Reads the centre lines, and the pegs of the robots that were placed anew."""
        state = self._envs.state()
        assert state.link_quaternion is not None, "a 3D model"
        self.half, self.radius = state.link_half_length, state.link_radius
        self.last = self.centre, self.axis
        self.centre, self.axis = state.link_position, axes(state.link_quaternion)
        for i in np.flatnonzero(moved).tolist():
            obstacles = self._envs.scene(i).obstacles
            self.walls = outlines(obstacles)
            self.pegs[i] = np.reshape(np.asarray(circles(obstacles), dtype=float), (-1, 3))

    def gaps(self, centre: Array, axis: Array, robots: NDArray[np.intp]) -> list[Array]:
        """Smallest gaps (n,) to pegs, walls, the ground and other links, of these robots with these centre lines."""
        to_peg = peg_gap(centre, axis, self.half, self.radius, [self.pegs[i] for i in robots])
        to_wall = wall_gap(centre, axis, self.half, self.radius, self.walls)
        to_ground = ground_gap(centre, axis, self.half, self.radius)
        return [to_peg, to_wall, to_ground, self_gap(centre, axis, self.half, self.radius)]

    def judge(self, found: Crawl, robots: NDArray[np.bool_]) -> None:
        """Adds overlaps and crossings of these robots."""
        judged = np.flatnonzero(robots)
        centre, axis = self.centre[judged], self.axis[judged]
        found.add_gaps(self.gaps(centre, axis, judged))
        last_centre, last_axis = self.last[0][judged], self.last[1][judged]
        travel = np.linalg.norm(centre - last_centre, axis=-1) + self.half * np.linalg.norm(axis - last_axis, axis=-1)
        moved = travel.max(axis=1) > self.radius.min()
        if not moved.any():
            return
        passed, near_wall = np.zeros((2, int(moved.sum())), dtype=bool)
        radius = self.radius.min()
        smallest = np.array([smallest_radius(self.pegs[i]) for i in judged[moved]])
        arm, middle = arm_of(centre, axis), [at[moved].mean(axis=1, keepdims=True) for at in (last_centre, centre)]

        def interpolated(share: float) -> tuple[Array, Array]:
            between = last_axis[moved] + share * (axis - last_axis)[moved]
            between /= np.linalg.norm(between, axis=-1, keepdims=True)
            return (1 - share) * middle[0] + share * middle[1] + chain(between, arm), between

        for share in np.linspace(0, 1, BETWEEN + 2)[1:-1]:
            to_peg, to_wall, _, to_self = self.gaps(*interpolated(share), judged[moved])
            passed |= (to_peg < -CROSSED * (radius + smallest)) | (to_self < -CROSSED * 2 * radius)
            near_wall |= to_wall < -CROSSED * radius
        # As in the plane, the centre line of a link that passes through a wall comes onto it.
        for share in np.linspace(0, 1, CLOSELY) if near_wall.any() else ():
            to_wall = wall_gap(*interpolated(share), self.half, self.radius, self.walls)
            passed |= near_wall & (to_wall < -ON_THE_WALL * radius)
        found.crossings += int(passed.sum())


def axes(quaternion: Array) -> Array:
    """e_z^B of orientations (..., 4), w first."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def ground_gap(centre: Array, axis: Array, half: Array, radius: Array) -> Array:
    """Smallest height (n,) of the lowest points of the links' end spheres."""
    return (centre[..., 2] - half * np.abs(axis[..., 2]) - radius).min(axis=1)


def peg_gap(centre: Array, axis: Array, half: Array, radius: Array, pegs: list[Array]) -> Array:
    """Smallest distance (n,) of the links' surfaces from pegs, vertical cylinders; infinite without pegs.

    Args:
        centre: (n, L, 3) CGs of the links [m].
        axis: (n, L, 3) directions of the centre lines.
        half: (L,) half lengths of the centre lines [m].
        radius: (L,) of the links [m].
        pegs: for each robot (P, 3) radius, x and y [m].
    """
    least = np.full(len(centre), np.inf)
    for i, own in enumerate(pegs):
        if len(own):
            offset = own[None, :, 1:] - centre[i, :, None, :2]
            shadow = axis[i, :, None, :2]
            along = (offset * shadow).sum(-1) / np.maximum((shadow**2).sum(-1), 1e-18)
            along = np.clip(along, -half[:, None], half[:, None])
            distance = np.linalg.norm(offset - along[..., None] * shadow, axis=-1)
            least[i] = (distance - radius[:, None] - own[None, :, 0]).min()
    return least


def wall_gap(centre: Array, axis: Array, half: Array, radius: Array, walls: list[Array]) -> Array:
    """Smallest distance (n,) of the links' surfaces from vertical walls, at least minus a radius.

    Infinite where none are close.

    Args:
        centre: as for :func:`peg_gap`.
        axis: likewise.
        half: likewise.
        radius: likewise.
        walls: corners (k, 2) of convex polygons in order, two of a segment [m].
    """
    arm = half[:, None] * axis[..., :2]
    start, end = ((centre[..., :2] + offset).reshape(-1, 2) for offset in (-arm, arm))
    least = walls_to_line(start, end, walls, float(radius.max())).reshape(centre.shape[:2])
    return np.asarray((least - radius).min(axis=1, initial=np.inf))


def self_gap(centre: Array, axis: Array, half: Array, radius: Array) -> Array:
    """Smallest distance (n,) of the surfaces of links that are not neighbours, infinite where none are close.

    The squared distance of two points of the centre lines is a convex quadratic of their two coordinates; its minimum
    over the rectangle of both lies inside or on one of the four sides.
    """
    first, second = np.triu_indices(centre.shape[1], 2)
    reach = (half + radius)[first] + (half + radius)[second]
    offset = centre[:, first] - centre[:, second]
    robot, pair = np.nonzero((offset**2).sum(-1) < reach**2)
    first, second = first[pair], second[pair]
    o, a, b = offset[robot, pair], axis[robot, first], axis[robot, second]
    h, k = half[first], half[second]

    def dot(u: Array, v: Array) -> Array:
        return (u * v).sum(-1)

    def distance(s: Array, t: Array) -> Array:
        return np.linalg.norm(o + s[:, None] * a - t[:, None] * b, axis=-1)

    c, ao, bo = dot(a, b), dot(a, o), dot(b, o)
    sides = [distance(s, np.clip(bo + s * c, -k, k)) for s in (-h, h)]
    sides += [distance(np.clip(t * c - ao, -h, h), t) for t in (-k, k)]
    sine = np.maximum(1 - c * c, 1e-30)
    s, t = (c * bo - ao) / sine, (bo - c * ao) / sine
    inside = (np.abs(s) <= h) & (np.abs(t) <= k)
    sides.append(np.where(inside, distance(np.clip(s, -h, h), np.clip(t, -k, k)), np.inf))
    least = np.full(len(centre), np.inf)
    np.minimum.at(least, robot, np.minimum.reduce(sides) - radius[first] - radius[second])
    return least


if __name__ == "__main__":
    sys.exit(main())
