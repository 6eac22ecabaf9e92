"""Two views of one robot in 3D: from above, and in a strip below from the side, where lifting shows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.config import Scene
from snake_env.obstacles import balls, circles, heights, solids
from snake_env.palette import FORCE, GRID, MARK, MARK_WIDTH, PEG
from snake_env.picture import Picture
from snake_env.rendering import EDGE, LOW, OVERSAMPLING, PIPE, Point, TopView, Trail, colour_of, dim, shade
from snake_env.state import State
from snake_env.surfaces import bodies, fields, ground_height, section

with extras():
    import pygame

STRIP_HEIGHT = 110
"""Height of the side view [pixels]."""
GROUND_LEVEL = 22
"""Height of the ground line in the strip [pixels]."""
HIGHEST_LIFT = 0.5
"""Height of a robot above the ground from which on the strip follows it, as on a pole [m]."""
BESIDE = 0.3
"""Pegs are shown up to so far from the line of the body [m]."""
SAMPLES = 400
"""Points of the profile of uneven ground across the strip."""
Section = tuple[float, float, float]
"""Height of an obstacle, and where it begins and ends along the body from the CG [m]."""
STRIP = (250, 249, 245)
NORMAL_FORCE_SCALE = 0.004
"""Length of a line under a link that the ground carries [m/N]."""


class TwoViews(TopView):
    """The top view with a strip that looks at the robot across its body, with obstacles that have a height."""

    def __init__(self, picture: Picture) -> None:
        super().__init__(picture)
        self._strip = pygame.Surface((self._camera.canvas[0], OVERSAMPLING * STRIP_HEIGHT))
        self._scale = self._camera.scale
        """Pixels of the strip per metre."""
        self._profile = np.zeros((2, 2))
        """Ground under the body: places along it, ascending, and heights (k, 2) [m]."""
        self._base = 0.0
        """Height at the ground line of the strip [m]."""

    def draw(self, state: State, scene: Scene, trail: Trail) -> pygame.Surface:
        """Picture as a surface."""
        width, height = self._picture.size
        picture = pygame.Surface((width, height + STRIP_HEIGHT))
        picture.blit(super().draw(state, scene, trail), (0, 0))
        there = scene.with_obstacles_at(state.obstacle_position, state.obstacle_angle, state.obstacle_height)
        self._draw_strip(state, there)
        picture.blit(pygame.transform.smoothscale(self._strip, (width, STRIP_HEIGHT)), (0, height))
        return picture

    def _draw_strip(self, state: State, scene: Scene) -> None:
        self._strip.fill(STRIP)
        axes = state.link_axis
        ahead = _body_direction(axes)
        across = np.array([-ahead[1], ahead[0]])
        places = state.link_middle - [*state.position, 0.0]
        along, depth = places[:, :2] @ ahead, places[:, :2] @ across
        shown = scene.obstacles if self._picture.shows("obstacles") else ()
        side = self._strip.get_width() / (2 * self._camera.scale)
        self._profile = _profile(shown, state, np.stack([along, depth], axis=1), 8.0 * side)
        under = (self._profile[:, 0] >= along.min()) & (self._profile[:, 0] <= along.max())
        ground = float(self._profile[under, 1].min(initial=np.inf)) if fields(shown) else 0.0
        feet = state.link_middle[:, 2] - np.abs(axes[:, 2]) * state.link_half_length - state.link_radius
        self._base = max(ground, float(feet.min()) - HIGHEST_LIFT)
        found = sections(state, scene, ahead) if shown else []
        self._scale = self._fitting_scale(state, found)
        self._draw_ground()
        self._draw_pegs(shown, state, ahead)
        self._draw_sections(found)
        self._draw_bodies_cut(shown, state, ahead)
        self._draw_balls(shown, state, ahead)
        for i in np.argsort(-depth, kind="stable"):
            centre = np.array([along[i], places[i, 2]])
            axis = np.array([axes[i, :2] @ ahead, axes[i, 2]])
            shape = float(state.link_half_length[i]), float(state.link_radius[i])
            self._capsule(centre, axis, shape, colour_of(i))
            back = state.link_back[i]
            if -back[:2] @ across > 0.1:  # one looks along `across`
                place = centre + shape[1] * np.array([back[:2] @ ahead, back[2]])
                start, end = (self._on_strip(place + side * 0.7 * shape[0] * axis) for side in (-1.0, 1.0))
                width = MARK_WIDTH * shape[1] * float(-back[:2] @ across) * self._scale
                pygame.draw.line(self._strip, MARK, start, end, max(1, round(width)))
            self._load(centre, np.asarray(state.normal_force)[i])

    def _fitting_scale(self, state: State, sections: list[Section]) -> float:
        """That of the view from above, halved until the highest link and the obstacles beside it fit."""
        tops = state.link_middle[:, 2] + np.abs(state.link_axis[:, 2]) * state.link_half_length + state.link_radius
        side = self._strip.get_width() / (2 * self._camera.scale)
        highest = max([float(tops.max()), *(height for height, start, end in sections if start < side and end > -side)])
        room = OVERSAMPLING * (STRIP_HEIGHT - GROUND_LEVEL)
        halvings = max(0.0, np.ceil(np.log2((highest - self._base) * self._camera.scale / room)))
        return float(self._camera.scale * 0.5**halvings)

    def _draw_ground(self) -> None:
        width, height = self._strip.get_size()
        surface = [self._on_strip(point) for point in self._profile]
        pygame.draw.polygon(self._strip, GRID[1], [(0, height), *surface, (width, height)])

    def _draw_bodies_cut(self, obstacles: Any, state: State, ahead: NDArray[np.float64]) -> None:
        """Polyhedra and poles where the plane cuts them, of pipes the wall."""
        for one in bodies(obstacles):
            line = section(one, np.asarray(state.position), ahead)
            if len(line) > 2:
                is_pipe = getattr(one, "inside", False)
                colour = PIPE if is_pipe else shade(float(line[:, 1].max()))
                corners = [self._on_strip(corner) for corner in line]
                pygame.draw.polygon(self._strip, colour, corners, OVERSAMPLING if is_pipe else 0)

    def _draw_pegs(self, obstacles: Any, state: State, ahead: NDArray[np.float64]) -> None:
        """Pegs without end beside the robot, behind it."""
        round_ones, _ = heights(obstacles)
        for height, (radius, x, y) in zip(round_ones, circles(obstacles), strict=True):
            along, across = _from_robot((x, y), state, ahead)
            if height is None and abs(across) < BESIDE:
                (left, foot), (right, _) = (self._on_strip((along + side * radius, 0.0)) for side in (-1.0, 1.0))
                pygame.draw.rect(self._strip, LOW, (left, 0.0, right - left, foot))

    def _draw_balls(self, obstacles: Any, state: State, ahead: NDArray[np.float64]) -> None:
        """Those beside the robot, behind it."""
        for radius, *place, height in balls(obstacles):
            along, across = _from_robot(place, state, ahead)
            if abs(across) < BESIDE:
                self._capsule(np.array([along, height]), np.zeros(2), (0.0, radius), PEG)

    def _draw_sections(self, sections: list[Section]) -> None:
        """Higher ones behind."""
        for height, start, end in sorted(sections, reverse=True):
            (left, low), (right, high) = self._on_strip((start, 0.0)), self._on_strip((end, height))
            pygame.draw.rect(self._strip, shade(height), (left, high, right - left, low - high))

    def _capsule(self, centre: NDArray[np.float64], axis: NDArray[np.float64], shape: Any, colour: Any) -> None:
        """Two discs and what lies between them."""
        half_length, radius = shape
        for r, fill in ((radius, dim(colour, EDGE)), (0.86 * radius, colour)):
            ends = centre + half_length * axis, centre - half_length * axis
            length = np.hypot(*axis)
            if length > 0.0:
                side = r / length * np.array([-axis[1], axis[0]])
                corners = [ends[0] + side, ends[1] + side, ends[1] - side, ends[0] - side]
                pygame.draw.polygon(self._strip, fill, [self._on_strip(corner) for corner in corners])
            for end in ends:
                pygame.draw.circle(self._strip, fill, self._on_strip(end), r * self._scale)

    def _load(self, centre: NDArray[np.float64], force: float) -> None:
        """The ground's normal force as a line below the ground."""
        foot = np.array([centre[0], np.interp(centre[0], *self._profile.T)])
        ends = self._on_strip(foot), self._on_strip(foot - [0.0, NORMAL_FORCE_SCALE * force])
        if force > 0.0:
            pygame.draw.line(self._strip, FORCE, *ends, 2 * OVERSAMPLING)

    def _on_strip(self, point: Any) -> Point:
        """Pixel of a point given by its place along the body and its height [m]."""
        x, z = (np.asarray(point) - [0.0, self._base]) * self._scale
        width, height = self._strip.get_size()
        return float(width / 2 + x), float(height - OVERSAMPLING * GROUND_LEVEL - z)


def sections(state: State, scene: Scene, ahead: NDArray[np.float64]) -> list[Section]:
    """Obstacles of finite height cut by the vertical plane through the CG along the body."""
    across = np.array([-ahead[1], ahead[0]])
    found = []
    for height, corners in solids(scene.obstacles):
        places = (corners - state.position) @ np.stack([ahead, across], axis=1)
        cut = [_crossing(places[k - 1], places[k]) for k in range(len(places))]
        along = [x for x in cut if x is not None]
        if len(along) > 1:
            found.append((height, min(along), max(along)))
    return found


def _profile(obstacles: Any, state: State, body: NDArray[np.float64], side: float) -> NDArray[np.float64]:
    """Ground under the line of the body, whose links are at (L, 2) along its direction and across it (k, 2) [m]."""
    if not fields(obstacles):
        return np.array([[-side, 0.0], [side, 0.0]])
    ahead = _body_direction(state.link_axis)
    line = body[np.argsort(body[:, 0])]
    inner = np.linspace(line[0, 0] - 1.0, line[-1, 0] + 1.0, SAMPLES)
    x = np.concatenate([np.linspace(-side, inner[0], SAMPLES), inner, np.linspace(inner[-1], side, SAMPLES)])
    places = np.stack([x, np.interp(x, *line.T)], axis=1) @ np.array([ahead, [-ahead[1], ahead[0]]])
    return np.stack([x, ground_height(obstacles, state.position + places)], axis=1)


def _from_robot(place: Any, state: State, ahead: NDArray[np.float64]) -> NDArray[np.float64]:
    """A place seen from above, along the body from the CG, and across it [m]."""
    frame = np.array([[ahead[0], ahead[1]], [-ahead[1], ahead[0]]])
    return np.asarray(frame @ (np.asarray(place) - state.position))


def _crossing(start: NDArray[np.float64], end: NDArray[np.float64]) -> float | None:
    """First coordinate at which an edge crosses the line where the second one is zero."""
    if (start[1] > 0.0) == (end[1] > 0.0):
        return None
    return float(start[0] - start[1] * (end[0] - start[0]) / (end[1] - start[1]))


def _body_direction(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean direction of the body seen from above; links point backwards."""
    mean = -axis[:, :2].sum(axis=0)
    length = np.hypot(*mean)
    return mean / length if length > 0.0 else np.array([1.0, 0.0])
