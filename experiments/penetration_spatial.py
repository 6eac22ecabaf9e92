"""How deep do links of the 3D model penetrate pegs, the ground and each other under random actions?

    python -m experiments.penetration_spatial
    python -m experiments.penetration_spatial --action-modes joints --steps 300000

The 3D companion of :mod:`experiments.penetration`: overlaps at every control instant, computed from the published poses
by the formulas below, which share nothing with the simulator. Links are capsules, pegs vertical cylinders without end;
what touches the ground are the end spheres. Steps in which a robot is flagged do not count; their number is
printed. Prints a table in Markdown.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import SnakeVectorEnv
from snake_env.markdown import table
from training.cli import answer

Array = NDArray[np.float64]

SCENES: dict[str, dict[str, Any]] = {"free": {"task": "free"}, "field": {"task": "field", "difficulty": 1.0}}
HELD = (1, 2, 20)
"""Control periods for which a random action is held; robots differ in it."""


@dataclass
class Options:
    """What is measured.

    Args:
        scenes: "free" or "field".
        action_modes: "gait", "joints" or "residual".
        steps: Robot-steps in each action mode, shared by the scenes.
        num_envs: Robots per batch.
        num_threads: Threads of the simulator.
        seed: Of scenes and actions.
    """

    scenes: tuple[str, ...] = tuple(SCENES)
    action_modes: tuple[str, ...] = ("gait", "joints", "residual")
    steps: int = 20_000
    num_envs: int = 128
    num_threads: int | None = None
    seed: int = 0


@dataclass
class Crawl:
    """The outcome of random actions in one scene.

    Args:
        steps: Robot-steps.
        overlap: Deepest overlap with a peg, the ground and another link at a control instant [m].
        beyond: Robot-steps with an overlap of more than a millimetre.
        flagged: Robot-steps that ended with a flagged robot.
    """

    steps: int = 0
    overlap: tuple[float, ...] = (0.0, 0.0, 0.0)
    beyond: int = 0
    flagged: int = 0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, _run, __doc__, arguments)


def _run(options: Options) -> int:
    head = ["actions", "scene", "steps", "peg [mm]", "ground [mm]", "self [mm]", "> 1 mm", "flagged"]
    print(table(head, _rows(options)))
    return 0


def _rows(options: Options) -> Iterator[list[str]]:
    for mode in options.action_modes:
        for scene in options.scenes:
            keywords = SCENES[scene] | {"model": "spatial", "action_mode": mode}
            steps = options.steps // len(options.scenes)
            found = crawl(keywords, steps, options.num_envs, options.num_threads, options.seed)
            print(mode, scene, found, file=sys.stderr, flush=True)
            overlaps = [f"{1e3 * depth:.3f}" for depth in found.overlap]
            yield [mode, scene, str(found.steps), *overlaps, str(found.beyond), str(found.flagged)]


def crawl(
    keywords: dict[str, Any], steps: int, num_envs: int = 128, num_threads: int | None = None, seed: int = 0
) -> Crawl:
    """Random actions for about ``steps`` robot-steps in the environment of these keywords."""
    envs = SnakeVectorEnv(num_envs=num_envs, num_threads=num_threads, **keywords)
    rng = np.random.default_rng(seed)
    held = np.resize(HELD, num_envs)
    envs.reset(seed=seed)
    pegs = [_pegs(envs, i) for i in range(num_envs)]
    action = rng.uniform(-1, 1, envs.action_space.shape)
    found = Crawl()
    ended = np.zeros(num_envs, dtype=bool)
    for step in range(max(1, steps // num_envs)):
        fresh = step % held == 0
        uniform, extreme = rng.uniform(-1, 1, action[fresh].shape), rng.choice([-1.0, 1.0], action[fresh].shape)
        action[fresh] = np.where(rng.random((fresh.sum(), 1)) < 0.5, uniform, extreme)
        _, _, terminated, truncated, info = envs.step(action.astype(np.float32))
        for i in np.flatnonzero(ended).tolist():
            pegs[i] = _pegs(envs, i)
        judged = ~ended & ~(info["diverged"] | info["penetrated"])
        found.steps += int(num_envs - ended.sum())
        found.flagged += int((info["diverged"] | info["penetrated"]).sum())
        state = envs.state()
        assert state.link_quaternion is not None, "a 3D model"
        centre, axis = state.link_position[judged], axes(state.link_quaternion[judged])
        half, radius = state.link_half_length, state.link_radius
        gaps = [
            peg_gap(centre, axis, half, radius, [pegs[i] for i in np.flatnonzero(judged)]),
            ground_gap(centre, axis, half, radius),
            self_gap(centre, axis, half, radius),
        ]
        found.overlap = tuple(max(a, float(-gap.min(initial=0.0))) for a, gap in zip(found.overlap, gaps, strict=True))
        found.beyond += int((np.minimum.reduce(gaps) < -1e-3).sum())
        ended = terminated | truncated
    envs.close()
    return found


def _pegs(envs: SnakeVectorEnv, i: int) -> Array:
    """Radius, x and y (P, 3) of the pegs around a robot."""
    return np.array(envs.scene(i).obstacles, dtype=float).reshape(-1, 3)


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
