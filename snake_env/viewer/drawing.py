"""One robot in its scene, drawn with the scene interface of viser."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.obstacles import (
    Box,
    Polygon,
    Segment,
    balls,
    centre,
    circles,
    heights,
    is_movable,
    outlines,
    placed,
    springs,
)
from snake_env.palette import (
    BODY,
    EARTH,
    FORCE,
    FORCE_SCALE,
    GOAL,
    HEAD,
    LONGEST_ARROW,
    MARK,
    MARK_WIDTH,
    PEG,
    PEG_HEIGHT,
    SPRING,
    SPRING_WIDTH,
    SUN,
    TRAIL,
    Colour,
    tint,
)
from snake_env.surfaces import bodies, fields, ground_height, mesh
from snake_env.viewer.frames import Frames

with extras():
    import trimesh

Array = NDArray[np.float64]

FORCE_SHOWN = 0.1
"""Forces below this have no arrow [N]."""
NO_ARROW = np.array([[[0.0, 0.0, -1e4], [0.0, 0.0, -1e4 - 0.01]]])
"""Out of sight: a set of arrows cannot be empty."""
SKY, DAYLIGHT = 1.6, 1.8
"""Intensities of the light, as in the playground."""
SHADE: Colour = (138, 143, 134)
"""Light from below."""
PIPE_OPACITY = 0.3
"""Of a pipe, in which robots are to be seen."""
RISE = 0.004
"""Height of lines on the ground [m]."""


class Drawing:
    """The robot of some frames, its scene, and the CG's trail up to the frame shown.

    Args:
        scene: of a server.
        frames: poses; :meth:`show` takes one of them.
        trail: draw the whole path of the CG.
    """

    def __init__(self, scene: Any, frames: Frames, trail: bool = True) -> None:
        self._scene = scene
        self._shapes: list[tuple[NDArray[np.int64], Any]] = []
        self.solids: list[Any] = []
        """Handles of obstacles and links, which can be clicked."""
        self._pegs: Any = None
        self._balls: Any = None
        self._moving: list[tuple[int, Any]] = []
        """Polygons that can be pushed: which of the obstacles that can be, and the handle."""
        self._springs: Any = None
        self._light()
        self._ground(frames)
        self._obstacles(frames)
        self._goal(frames)
        self._links(frames)
        self._arrows = scene.add_arrows(
            "/forces", NO_ARROW, FORCE, shaft_radius=0.006, head_radius=0.016, head_length=0.035, visible=False
        )
        if trail and len(frames) > 1:
            self.trail(frames)

    def _light(self) -> None:
        self._scene.add_light_hemisphere("/sky", ground_color=SHADE, intensity=SKY)
        self._scene.add_light_directional(
            "/sun", intensity=DAYLIGHT, cast_shadow=True, position=tuple(5.0 * np.array(SUN))
        )

    def _ground(self, frames: Frames) -> None:
        """A grid around everything; an inclined plane is drawn level, as the model's coordinates are."""
        low, high = frames.position[..., :2].min(axis=(0, 1)), frames.position[..., :2].max(axis=(0, 1))
        middle, size = 0.5 * (low + high), float(np.ceil(max(high - low) + 8.0))
        self._scene.add_grid(
            "/ground", width=size, height=size, cell_size=0.1, section_size=1.0, position=(*np.round(middle), 0.0)
        )

    def _obstacles(self, frames: Frames) -> None:
        found = circles(frames.scene.obstacles)
        round_ones, others = heights(frames.scene.obstacles)
        if found:
            radius, x, y = np.array(found).T
            height = np.array([PEG_HEIGHT if one is None else one for one in round_ones])
            unit = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=48)
            pegs = self._scene.add_batched_meshes_simple(
                "/pegs",
                unit.vertices,
                unit.faces,
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(found), 1)),
                batched_positions=np.stack([x, y, 0.5 * height], axis=1),
                batched_scales=np.stack([radius, radius, height], axis=1),
                batched_colors=linear(PEG),
                flat_shading=True,  # else the edges of the top faces look round
            )
            self.solids.append(pegs)
            self._pegs = pegs
        for k, patch in enumerate(frames.scene.patches):
            # The later ones, which count, over the others.
            flat = _prism(np.array(patch.vertices), 0.25 * RISE * (1.0 + k / len(frames.scene.patches)))
            flat_look: dict[str, Any] = {"color": tint(patch.factor), "cast_shadow": False}
            self._scene.add_mesh_simple(f"/patches/{k}", flat.vertices, flat.faces, **flat_look)
        before = accumulate(map(is_movable, frames.scene.obstacles), initial=0)
        numbered = zip(frames.scene.obstacles, before, strict=False)
        walls = [(one, j) for one, j in numbered if isinstance(one, Segment | Box | Polygon)]
        for k, ((one, j), top) in enumerate(zip(walls, others, strict=True)):
            (corners,) = outlines([one])
            middle = centre(one) if is_movable(one) else np.zeros(2)
            wall = _prism(corners - middle, PEG_HEIGHT if top is None else top)
            look: dict[str, Any] = {"color": PEG, "side": "double", "position": (*middle, 0.0)}
            made = self._scene.add_mesh_simple(f"/walls/{k}", wall.vertices, wall.faces, **look)
            self.solids.append(made)
            if is_movable(one):
                self._moving.append((j, made))
        round_in_space = balls(frames.scene.obstacles)
        if len(round_in_space):
            ball = trimesh.creation.icosphere(subdivisions=3)
            self._balls = self._scene.add_batched_meshes_simple(
                "/balls",
                ball.vertices,
                ball.faces,
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(round_in_space), 1)),
                batched_positions=round_in_space[:, 1:],
                batched_scales=np.repeat(round_in_space[:, :1], 3, axis=1),
                batched_colors=linear(PEG),
            )
            self.solids.append(self._balls)
        self._hold(frames)
        self._surfaces("/fields", fields(frames.scene.obstacles), EARTH)
        self._surfaces("/bodies", bodies(frames.scene.obstacles), PEG)

    def _hold(self, frames: Frames) -> None:
        """Springs of pegs that yield: marks where they hold them, and lines from there to the pegs."""
        held = springs_in(frames, 0)
        if len(held):
            mark = trimesh.creation.cylinder(radius=SPRING_WIDTH, height=RISE)
            self._scene.add_batched_meshes_simple(
                "/anchors",
                mark.vertices,
                mark.faces,
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(held), 1)),
                batched_positions=held[:, 0],
                batched_colors=linear(SPRING),
            )
            self._springs = self._scene.add_line_segments("/springs", held, SPRING, thickness=0.01)

    def _surfaces(self, name: str, obstacles: Sequence[Any], colour: Colour) -> None:
        for k, one in enumerate(obstacles):
            opacity = PIPE_OPACITY if getattr(one, "inside", False) else None
            look: dict[str, Any] = {"color": colour, "opacity": opacity, "side": "double", "flat_shading": True}
            self._scene.add_mesh_simple(f"{name}/{k}", *mesh(one), **look)

    def _goal(self, frames: Frames) -> None:
        if frames.goal is None:
            return
        x, y = frames.goal
        if frames.goal_radius > 0.0:
            turn = np.linspace(0.0, 2.0 * np.pi, 49)
            line = np.stack([x + frames.goal_radius * np.cos(turn), y + frames.goal_radius * np.sin(turn)], axis=1)
        else:
            line = np.stack([np.full(41, x), y + np.linspace(-1.0, 1.0, 41)], axis=1)
        self._ground_line("/goal", line, frames, GOAL)

    def _links(self, frames: Frames) -> None:
        """One batch of capsules per shape, so that 200 links are as cheap as ten, and one of the marks on them."""
        shapes = np.stack([frames.half_length, frames.radius], axis=1)
        for k, (half, radius) in enumerate(np.unique(shapes, axis=0)):
            rows = np.flatnonzero((shapes == (half, radius)).all(axis=1))
            colours = np.array(BODY, np.uint8)[rows % 2]
            colours[rows == 0] = HEAD
            capsule = trimesh.creation.capsule(height=2.0 * half, radius=radius, count=(16, 16))
            capsule.apply_translation(-capsule.bounds.mean(axis=0))
            back = np.array(frames.back)
            across = np.array([abs(back[1]), abs(back[0]), 0.0])
            size = radius * (MARK_WIDTH * across + 0.1 * np.abs(back)) + [0.0, 0.0, 1.4 * half]
            mark = trimesh.creation.box(extents=size)
            mark.apply_translation(0.97 * radius * back)
            for name, shape, colour in (("links", capsule, colours), ("marks", mark, MARK)):
                handle = self._scene.add_batched_meshes_simple(
                    f"/{name}/{k}",
                    shape.vertices,
                    shape.faces,
                    batched_wxyzs=frames.quaternion[0, rows],
                    batched_positions=frames.position[0, rows],
                    batched_colors=linear(colour),
                    lod="off",
                )
                self._shapes.append((rows, handle))
            self.solids.append(self._shapes[-2][1])

    def trail(self, frames: Frames) -> None:
        """Draws the path of the CG on the ground."""
        self._ground_line("/trail", frames.position[..., :2].mean(axis=1), frames, TRAIL)

    def _ground_line(self, name: str, line: Array, frames: Frames, colour: Colour) -> None:
        self._line(name, np.c_[line, ground_height(frames.scene.obstacles, line) + RISE], colour)

    def _line(self, name: str, points: Array, colour: Colour) -> None:
        pairs = np.stack([points[:-1], points[1:]], axis=1)
        self._scene.add_line_segments(name, pairs, colour, thickness=2.0, thickness_units="screen")

    def show(self, frames: Frames, k: int) -> None:
        """Moves links and force arrows to frame ``k``."""
        if frames.obstacle_position.shape[1]:
            height = frames.obstacle_height[k] if frames.obstacle_height.shape[1] else None
            there = placed(frames.scene.obstacles, frames.obstacle_position[k], height=height)
            if self._pegs is not None:
                discs = np.array(circles(there))
                self._pegs.batched_positions = np.c_[discs[:, 1:], self._pegs.batched_positions[:, 2]]
            if self._balls is not None:
                self._balls.batched_positions = balls(there)[:, 1:]
        for j, handle in self._moving:
            half = 0.5 * frames.obstacle_angle[k, j]
            handle.position = (*frames.obstacle_position[k, j], 0.0)
            handle.wxyz = (np.cos(half), 0.0, 0.0, np.sin(half))
        if self._springs is not None:
            self._springs.points = springs_in(frames, k)
        for rows, handle in self._shapes:
            handle.batched_positions = frames.position[k, rows]
            handle.batched_wxyzs = frames.quaternion[k, rows]
        points = arrows(frames.position[k], frames.force[k])
        self._arrows.visible = points is not NO_ARROW
        self._arrows.points = points


def linear(colour: Any) -> NDArray[np.uint8]:
    """Colours (..., 3) of a batch: viser takes them for linear ones, and would show those of sRGB too bright."""
    share = np.asarray(colour, float) / 255.0
    return np.round(255.0 * np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)).astype(np.uint8)


def springs_in(frames: Frames, k: int) -> Array:
    """Both ends of the springs in a frame, above the pegs (s, 2, 3) [m]."""
    position = frames.obstacle_position[k] if frames.obstacle_position.shape[1] else np.empty((0, 2))
    ends = springs(frames.scene.obstacles, position)
    return np.concatenate([ends, np.full((len(ends), 2, 1), PEG_HEIGHT + RISE)], axis=2)


def arrows(position: Array, force: Array) -> Array:
    """Starts and ends (k, 2, 3) of the arrows of the forces (L, 3) [N] on links at (L, 3); they end at the links.

    Those of large forces are cut to ``LONGEST_ARROW``.
    """
    shown = np.linalg.norm(force, axis=1) > FORCE_SHOWN
    if not shown.any():
        return NO_ARROW
    above = position[shown] + np.array([0.0, 0.0, 0.06])
    length = FORCE_SCALE * np.linalg.norm(force[shown], axis=1, keepdims=True)
    return np.stack([above - np.minimum(1.0, LONGEST_ARROW / length) * FORCE_SCALE * force[shown], above], axis=1)


def _prism(corners: Sequence[Any] | Array, height: float) -> trimesh.Trimesh:
    """The upright walls over an outline (k, 2), and their convex lid."""
    outline = np.asarray(corners, float)
    n = len(outline)
    vertices = np.concatenate([np.c_[outline, np.zeros(n)], np.c_[outline, np.full(n, height)]])
    k = np.arange(n)
    following = (k + 1) % n
    sides = np.concatenate([np.c_[k, following, k + n], np.c_[following, following + n, k + n]])
    lid = np.c_[np.full(max(n - 2, 0), n), np.arange(n + 1, 2 * n - 1), np.arange(n + 2, 2 * n)]
    return trimesh.Trimesh(vertices, np.concatenate([sides, lid]), process=False)
