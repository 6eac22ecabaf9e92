"""How deep do links penetrate pegs and each other under random actions? The deepest overlap at any control instant.

    python -m experiments.penetration
    python -m experiments.penetration --action-modes joints --steps 1000000
    python -m experiments.penetration --policies general perturbed   # in the tasks of the benchmark

Overlaps are computed from the published poses by the formulas below, which share nothing with the simulator: the
distance of stadiums is that of their centre lines less their radii. Between two instants the chain is interpolated, and
a link that is then deep inside a peg or another link, or has its centre line on a wall, has passed through it. Steps in
which a robot is flagged
(`diverged`, `penetrated`) do not count; their number is printed. Prints a table in Markdown.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from experiments.crawl import Crawl
from experiments.crawl import crawl as random_crawl
from experiments.crawl import play as play_episodes
from snake_env import Scene, SnakeVectorEnv
from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.markdown import table
from snake_env.obstacles import Box, Polygon, Segment, circles, outlines
from snake_env.policies.interface import Policy
from snake_env.policies.shipped import load_policy
from training.cli import answer
from training.config import Count, Seed

Array = NDArray[np.float64]

ROOM = Scene(
    obstacles=[
        Segment((-2.2, -0.35), (1.6, -0.35)),
        Segment((-2.2, 0.35), (0.9, 0.35)),
        Segment((0.9, 0.35), (1.6, -0.35)),  # with the first, a corner of 45 degrees
        Segment((-2.2, -0.35), (-2.2, 0.35)),
        Box((0.2, 0.2), 0.35, 0.3, angle=0.5),
        Polygon(((0.2, -0.35), (0.5, -0.35), (0.35, -0.2))),
        Box((0.6, 0.05), -1.7, 0.1, angle=0.3, friction=0.3),
        (0.1, 0.8, -0.1),
    ],
    friction=(0.2, 0.5),
)
"""Walls and corners, a box, a rough one and a peg around the robot."""

SCENES: dict[str, dict[str, Any]] = {
    "course": {"task": "course"},
    "field 0": {"task": "field", "difficulty": 0.0},
    "field 0.5": {"task": "field", "difficulty": 0.5},
    "field 1": {"task": "field", "difficulty": 1.0},
    "perturbed": {"task": "perturbed", "difficulty": 1.0},
    "maze": {"task": "maze", "difficulty": 0.5},
    "corridor": {"task": "corridor", "difficulty": 0.5},
    "walls": {"task": "free", "scene": ROOM},
}
ACTION_MODES = ("gait", "joints", "residual", "velocities", "torques")
BETWEEN = 5
"""Interpolated poses per control period."""
CROSSED = 0.5
"""Overlap of an interpolated pose, relative to the sum of the radii, that counts as passing through; a wall is then
looked at more closely."""
CLOSELY = 100
"""Interpolated poses per control period of a robot that may have passed through a wall."""
ON_THE_WALL = 0.95
"""Overlap with a wall, relative to the radius, of a centre line that lies on it, up to the way between such poses."""


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
        policies: Instead of random actions, shipped policies or files, in each task of the benchmark.
        scenes_per_task: Test scenes of each task that these play, one episode each.
    """

    scenes: tuple[str, ...] = tuple(SCENES)
    action_modes: tuple[str, ...] = ACTION_MODES
    steps: Count = 100_000
    num_envs: Count = 256
    num_threads: int | None = None
    seed: Seed = 0
    policies: tuple[str, ...] = ()
    scenes_per_task: Count = 40


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, _run, __doc__, arguments)


HEADS = ["actions", "scene", "steps", "peg [mm]", "self [mm]", "> 1 mm", "crossings", "flagged"]


def _run(options: Options) -> int:
    print(table(HEADS, _policy_rows(options) if options.policies else _rows(options)))
    return 0


def _policy_rows(options: Options) -> Iterator[list[str]]:
    for name in options.policies:
        for task in (one for one in tasks.chosen(None) if one.model == "planar"):
            found = play(load_policy(name), task, seeds.held_out(options.scenes_per_task), options.num_threads)
            yield _row(name, task.name, found)


def _row(actions: str, scene: str, found: Crawl) -> list[str]:
    overlaps = [f"{1e3 * depth:.3f}" for depth in found.overlap]
    counts = [str(count) for count in (found.beyond, found.crossings, found.flagged)]
    print(actions, scene, found, file=sys.stderr, flush=True)
    return [actions, scene, str(found.steps), *overlaps, *counts]


def _rows(options: Options) -> Iterator[list[str]]:
    for mode in options.action_modes:
        for scene in options.scenes:
            found = crawl(
                SCENES[scene] | {"action_mode": mode},
                options.steps // len(options.scenes),
                options.num_envs,
                options.num_threads,
                options.seed,
            )
            yield _row(mode, scene, found)


def crawl(
    options: dict[str, Any], steps: int, num_envs: int = 256, num_threads: int | None = None, seed: int = 0
) -> Crawl:
    """Random actions for about ``steps`` robot-steps in the environment of these keywords."""
    envs = SnakeVectorEnv(num_envs=num_envs, num_threads=num_threads, **options)
    return random_crawl(envs, _Bodies, steps, seed)


def play(policy: Policy, task: BenchmarkTask, fields: list[int], num_threads: int | None = None) -> Crawl:
    """A policy's first episodes of these seeds in a task of the benchmark, judged at every control instant."""
    options = {"autoreset_mode": "Disabled", "num_threads": num_threads, **task.options, **policy.env_options}
    envs = cast(SnakeVectorEnv, gym.make_vec(task.env_id, num_envs=len(fields), **options).unwrapped)
    return play_episodes(envs, _Bodies, policy, fields)


class _Bodies:
    """Poses, shapes and pegs of all robots, and the walls, which are the same for all."""

    def __init__(self, envs: SnakeVectorEnv) -> None:
        self._envs = envs
        self.pose = np.empty((0, 0, 3))
        self.pegs = np.empty((envs.num_envs, 0, 3))
        self.walls: list[Array] = []
        self.read(np.ones(envs.num_envs, dtype=bool))

    def read(self, moved: NDArray[np.bool_]) -> None:
        """Reads the poses, and the pegs of the robots that were placed anew."""
        state = self._envs.state()
        self.half, self.radius = state.link_half_length, state.link_radius
        self.last = self.pose
        self.pose = np.concatenate([state.link_position, np.asarray(state.link_angle)[..., None]], axis=-1)
        for i in np.flatnonzero(moved):
            obstacles = self._envs.scene(int(i)).obstacles
            self.walls = outlines(obstacles)
            pegs = np.reshape(np.asarray(circles(obstacles), dtype=float), (-1, 3))
            missing = max(0, len(pegs) - self.pegs.shape[1])
            self.pegs = np.pad(self.pegs, ((0, 0), (0, missing), (0, 0)), constant_values=np.inf)
            self.pegs[i] = np.inf
            self.pegs[i, :, 0] = 0.0
            self.pegs[i, : len(pegs)] = pegs

    def judge(self, found: Crawl, judged: NDArray[np.bool_]) -> None:
        """Adds overlaps and crossings of these robots."""
        pose, last, pegs = self.pose[judged], self.last[judged], self.pegs[judged]
        to_peg = peg_gap(pose, self.half, self.radius, pegs)
        to_peg = np.minimum(to_peg, wall_gap(pose, self.half, self.radius, self.walls))
        found.add_gaps([to_peg, self_gap(pose, self.half, self.radius)])
        moved = np.linalg.norm(pose - last, axis=-1).max(axis=1) > self.radius.min()
        if moved.any():
            has_passed = passed_through(last[moved], pose[moved], self.half, self.radius, pegs[moved], self.walls)
            found.crossings += int(has_passed.sum())


def passed_through(
    last: Array, pose: Array, half: Array, radius: Array, pegs: Array, walls: list[Array]
) -> NDArray[np.bool_]:
    """Whether links passed through a peg, a wall or each other (n,) on the way from ``last`` to ``pose``.

    Links that swing beside a wall come deep into it when the chain is interpolated; those that pass through it also
    come onto it with their centre lines.
    """
    thickness = radius.min() + smallest_radius(pegs)
    passed, near_wall = np.zeros((2, len(pose)), dtype=bool)
    for share in np.linspace(0, 1, BETWEEN + 2)[1:-1]:
        between = interpolated(last, pose, share)
        passed |= peg_gap(between, half, radius, pegs) < -CROSSED * thickness
        passed |= self_gap(between, half, radius) < -CROSSED * 2 * radius.min()
        near_wall |= wall_gap(between, half, radius, walls) < -CROSSED * radius.min()
    for share in np.linspace(0, 1, CLOSELY) if near_wall.any() else ():
        between = interpolated(last[near_wall], pose[near_wall], share)
        passed[near_wall] |= wall_gap(between, half, radius, walls) < -ON_THE_WALL * radius.min()
    return passed


def smallest_radius(pegs: Array) -> Array:
    """Radius (n,) of the smallest of the pegs (n, P, 3), infinite without any [m]."""
    return np.asarray(np.where(np.isfinite(pegs[..., 1]), pegs[..., 0], np.inf).min(axis=-1, initial=np.inf))


def interpolated(last: Array, pose: Array, share: float) -> Array:
    """Poses (n, L, 3) of chains on the way from ``last`` to ``pose``, with closed joints.

    Their links turn steadily, and the mean of their CGs moves steadily.
    """
    angle = last[..., 2] + share * (pose[..., 2] - last[..., 2])
    centre = chain(_directions(angle), arm_of(pose[..., :2], _directions(pose[..., 2])))
    middle = (1 - share) * last[..., :2].mean(axis=1) + share * pose[..., :2].mean(axis=1)
    return np.concatenate([middle[:, None] + centre, angle[..., None]], axis=-1)


def _directions(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def arm_of(centre: Array, direction: Array) -> float:
    """From the CG of a link to its joints [m], alike for all links; ``centre`` and ``direction`` are (n, L, d)."""
    way, both = np.diff(centre, axis=1), direction[:, 1:] + direction[:, :-1]
    return float((way * both).sum() / (both * both).sum())


def chain(direction: Array, arm: float) -> Array:
    """CGs (n, L, d) of links with these directions and joints at ``arm`` from their CGs, around their mean."""
    centre = np.cumsum(arm * (direction[:, 1:] + direction[:, :-1]), axis=1)
    centre = np.concatenate([np.zeros_like(direction[:, :1]), centre], axis=1)
    return np.asarray(centre - centre.mean(axis=1, keepdims=True))


def peg_gap(pose: Array, half: Array, radius: Array, pegs: Array) -> Array:
    """Smallest distance (n,) of the links' surfaces from pegs; infinite where none are close to each other.

    Args:
        pose: (n, L, 3) x, y and angle of the links [m, rad].
        half: (L,) half lengths of the centre lines [m].
        radius: (L,) of the links [m].
        pegs: (n, P, 3) radius, x and y [m]; one at infinity is no peg.
    """
    middle = pose[:, :, :2].mean(axis=1)
    extent = np.linalg.norm(pose[:, :, :2] - middle[:, None], axis=-1).max(axis=1, initial=0.0) + (half + radius).max()
    robot, peg = np.nonzero(_squared_distance(middle[:, None], pegs[:, :, 1:]) < (extent[:, None] + pegs[:, :, 0]) ** 2)
    reach = half + radius + pegs[robot, peg, :1]
    pair, link = np.nonzero(_squared_distance(pose[robot], pegs[robot, peg, None, 1:]) < reach**2)
    robot, peg = robot[pair], peg[pair]
    start, end = _ends(pose[robot, link], half[link])
    gap = _to_segment(pegs[robot, peg, 1:], start, end) - radius[link] - pegs[robot, peg, 0]
    return _least(len(pose), robot, gap)


def wall_gap(pose: Array, half: Array, radius: Array, walls: list[Array]) -> Array:
    """Smallest distance (n,) of the links' surfaces from walls, at least minus a radius: centre lines that cross a wall
    count as lying on its outline; infinite where none are close to each other.

    Args:
        pose: as for :func:`peg_gap`.
        half: likewise.
        radius: likewise.
        walls: corners (k, 2) of convex polygons in order, two of a segment [m].
    """
    robots, links = pose.shape[:2]
    start, end = _ends(pose.reshape(-1, 3), np.tile(half, robots))
    least = walls_to_line(start, end, walls, float(radius.max())).reshape(robots, links)
    return np.asarray((least - radius).min(axis=1, initial=np.inf))


def walls_to_line(start: Array, end: Array, walls: list[Array], within: float) -> Array:
    """Distance (n,) of the line from ``start`` to ``end``, (n, 2) each, from the nearest wall, 0 where they cross.

    Infinite where all walls are farther than ``within`` [m].
    """
    least = np.full(len(start), np.inf)
    middle, reach = 0.5 * (start + end), 0.5 * np.linalg.norm(end - start, axis=1) + within
    for corners in walls:
        least[_inside(start, corners)] = 0.0
        sides = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
        for first, second in sides[:1] if len(corners) == 2 else sides:
            near = np.flatnonzero(_to_segment(middle, first, second) < reach)
            a, b = start[near], end[near]
            ends = [_to_segment(a, first, second), _to_segment(b, first, second)]
            distance = np.minimum.reduce([*ends, _to_segment(first, a, b), _to_segment(second, a, b)])
            distance[_intersect(a, b, first, second)] = 0.0
            least[near] = np.minimum(least[near], distance)
    return least


def _inside(point: Array, corners: Array) -> NDArray[np.bool_]:
    """Whether points lie within a convex polygon; none lies within a segment."""
    if len(corners) < 3:
        return np.zeros(len(point), dtype=bool)
    along = np.roll(corners, -1, axis=0) - corners
    offset = point[:, None] - corners
    turns = along[:, 0] * offset[..., 1] - along[:, 1] * offset[..., 0]
    return np.asarray((turns > 0).all(axis=1) | (turns < 0).all(axis=1))


def self_gap(pose: Array, half: Array, radius: Array) -> Array:
    """Smallest distance (n,) of the surfaces of links that are not neighbours; arguments as :func:`peg_gap`."""
    first, second = np.triu_indices(pose.shape[1], 2)
    reach = (half + radius)[first] + (half + radius)[second]
    robot, pair = np.nonzero(_squared_distance(pose[:, first], pose[:, second]) < reach**2)
    first, second = first[pair], second[pair]
    lines = [_ends(pose[robot, links], half[links]) for links in (first, second)]
    distance = np.minimum.reduce([_to_segment(point, *lines[1 - k]) for k in (0, 1) for point in lines[k]])
    distance = np.where(_intersect(*lines[0], *lines[1]), 0.0, distance)
    return _least(len(pose), robot, distance - radius[first] - radius[second])


def _squared_distance(pose: Array, other: Array) -> Array:
    return (pose[..., 0] - other[..., 0]) ** 2 + (pose[..., 1] - other[..., 1]) ** 2


def _ends(pose: Array, half: Array) -> tuple[Array, Array]:
    """The ends of centre lines."""
    arm = half[:, None] * np.stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])], axis=-1)
    return pose[:, :2] - arm, pose[:, :2] + arm


def _least(robots: int, robot: NDArray[np.intp], gap: Array) -> Array:
    """Smallest gap of each robot."""
    least = np.full(robots, np.inf)
    np.minimum.at(least, robot, gap)
    return least


def _to_segment(point: Array, start: Array, end: Array) -> Array:
    """Distance of points from segments."""
    along = end - start
    share = np.clip(((point - start) * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-30), 0.0, 1.0)
    return np.linalg.norm(point - start - share[..., None] * along, axis=-1)


def _intersect(a: Array, b: Array, c: Array, d: Array) -> NDArray[np.bool_]:
    """Whether the segments a-b and c-d cross."""

    def turns(p: Array, q: Array, r: Array) -> Array:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    return (turns(a, b, c) * turns(a, b, d) < 0) & (turns(c, d, a) * turns(c, d, b) < 0)


if __name__ == "__main__":
    sys.exit(main())
