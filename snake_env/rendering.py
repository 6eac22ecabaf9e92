"""Top view of one robot, drawn with pygame: pegs, links, contact forces, trail, goal line."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

import pygame

SIZE = (800, 480)
"""Width and height of the picture [pixels]."""
OVERSAMPLING = 2
"""Pixels drawn for each pixel of the picture and direction, for smooth edges."""
VIEW_WIDTH = 2.8
"""Width of the ground that is seen [m]."""
FORCE_SCALE = 0.012
"""Length of an arrow [m/N]."""

CAPTION_HEIGHT = 36
"""Height of the strip with the caption, at the top [pixels]."""

CANVAS = (OVERSAMPLING * SIZE[0], OVERSAMPLING * SIZE[1])

GROUND = (238, 234, 224)
GRID = (221, 215, 202)
BORDER = (160, 148, 122)
PEG = (120, 128, 138)
BODY = ((56, 118, 88), (74, 138, 106))
HEAD = (224, 142, 50)
OUTLINE = (32, 60, 46)
TRAIL = (150, 178, 160)
FORCE = (190, 40, 48)
GOAL = (60, 100, 180)
TEXT = (40, 40, 40)
CAPTION = (250, 249, 245)

Point = tuple[float, float]


def caption(snapshot: dict[str, Any]) -> str:
    """Time, way and speed in words; what rounds to zero has no sign."""
    distance, speed = round(snapshot["distance"], 2) + 0.0, round(snapshot["speed"], 2) + 0.0
    return f"t = {snapshot['time']:.2f} s    distance {distance:.2f} m    speed {speed:.2f} m/s"


class Camera:
    """Maps the ground to pixels; it follows a point and keeps +y up."""

    def __init__(self) -> None:
        self.scale = OVERSAMPLING * SIZE[0] / VIEW_WIDTH
        self.centre: NDArray[np.float64] = np.zeros(2)

    def pixel(self, point: Any) -> Point:
        """Pixel of a point on the ground [m]."""
        x, y = (np.asarray(point) - self.centre) * self.scale
        return float(CANVAS[0] / 2 + x), float(CANVAS[1] / 2 - y)


class TopView:
    """The picture of one robot; it keeps the trail of its CG from one picture to the next."""

    def __init__(self) -> None:
        self._surface = pygame.Surface(CANVAS)
        self._camera = Camera()
        self._trail: list[NDArray[np.float64]] = []
        self._last_time = float("inf")
        self._font: Any = None
        self._window: Any = None
        self._clock: Any = None

    def image(self, snapshot: dict[str, Any]) -> NDArray[np.uint8]:
        """Picture (height, width, 3)."""
        pixels = pygame.surfarray.array3d(self._draw(snapshot))
        return np.ascontiguousarray(np.transpose(pixels, (1, 0, 2)))

    def show(self, snapshot: dict[str, Any], frames_per_second: int) -> None:
        """Shows the picture in a window and waits for the time of the next one."""
        picture = self._draw(snapshot)
        if self._window is None:
            pygame.display.init()
            pygame.display.set_caption("snake_env")
            self._window = pygame.display.set_mode(picture.get_size())
            self._clock = pygame.time.Clock()
        self._window.blit(picture, (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            pygame.display.quit()
            self._window = None

    def _draw(self, snapshot: dict[str, Any]) -> pygame.Surface:
        self._follow(snapshot)
        self._surface.fill(GROUND)
        self._draw_grid()
        self._draw_goal(snapshot)
        self._draw_pegs(snapshot["pegs"])
        self._draw_trail()
        self._draw_links(snapshot)
        self._draw_forces(snapshot)
        picture = pygame.transform.smoothscale(self._surface, SIZE)
        self._write(picture, caption(snapshot))
        return picture

    def _follow(self, snapshot: dict[str, Any]) -> None:
        centre = np.array(snapshot["centre"])
        if snapshot["time"] < self._last_time:
            self._trail.clear()
        if snapshot["time"] != self._last_time:
            self._trail.append(centre)
        self._last_time = snapshot["time"]
        self._camera.centre = centre

    def _draw_grid(self, spacing: float = 0.25) -> None:
        half = np.array(CANVAS) / (2 * self._camera.scale)
        first, last = np.ceil((self._camera.centre - half) / spacing), (self._camera.centre + half) / spacing
        for x in np.arange(first[0], last[0] + 1) * spacing:
            px = self._camera.pixel((x, 0.0))[0]
            pygame.draw.line(self._surface, GRID, (px, 0), (px, CANVAS[1]), OVERSAMPLING)
        for y in np.arange(first[1], last[1] + 1) * spacing:
            py = self._camera.pixel((0.0, y))[1]
            pygame.draw.line(self._surface, GRID, (0, py), (CANVAS[0], py), OVERSAMPLING)

    def _draw_goal(self, snapshot: dict[str, Any]) -> None:
        """The goal disc, or the goal line across the corridor and the corridor's bounds."""
        if "goal_disc" in snapshot:
            x, y, radius = snapshot["goal_disc"]
            self._disc((x, y), radius, GOAL)
            self._disc((x, y), radius - 0.02, GROUND)
            return
        goal, half_width = snapshot["goal_line"], snapshot["corridor_half_width"]
        right, left = snapshot["centre_line"] - half_width, snapshot["centre_line"] + half_width
        self._line((goal, right), (goal, left), GOAL, 4)
        back = self._camera.centre[0] - VIEW_WIDTH
        for y in (right, left):
            self._line((back, y), (goal, y), BORDER, 3)

    def _draw_pegs(self, pegs: NDArray[np.float64]) -> None:
        for radius, x, y in pegs:
            self._disc((x, y), radius, PEG)

    def _draw_trail(self) -> None:
        if len(self._trail) > 1:
            points = [self._camera.pixel(point) for point in self._trail]
            pygame.draw.lines(self._surface, TRAIL, False, points, 2 * OVERSAMPLING)

    def _draw_links(self, snapshot: dict[str, Any]) -> None:
        """Each link as a stadium: straight sides and round ends."""
        links = list(zip(snapshot["pose"], snapshot["shape"], strict=True))
        outline = 2 * OVERSAMPLING / self._camera.scale
        for pose, (half_length, radius) in links:
            self._stadium(pose, half_length, radius, OUTLINE)
        for i, (pose, (half_length, radius)) in reversed(list(enumerate(links))):
            self._stadium(pose, half_length, radius - outline, HEAD if i == 0 else BODY[i % 2])

    def _stadium(self, pose: NDArray[np.float64], half_length: float, radius: float, colour: Any) -> None:
        x, y, angle = pose
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        centre = np.array([x, y])
        ends = centre + half_length * along, centre - half_length * along
        corners = [end + side * radius * across for end, side in zip((*ends, *ends[::-1]), (1, 1, -1, -1), strict=True)]
        self._polygon(corners, colour)
        for end in ends:
            self._disc(end, radius, colour)

    def _draw_forces(self, snapshot: dict[str, Any]) -> None:
        """The mean force of the pegs on each link during the last control period."""
        for pose, force in zip(snapshot["pose"], snapshot["contact_force"], strict=True):
            if np.hypot(*force) * FORCE_SCALE > 0.005:
                self._arrow(pose[:2], pose[:2] + FORCE_SCALE * force)

    def _arrow(self, start: NDArray[np.float64], end: NDArray[np.float64], head: float = 0.04) -> None:
        along = (end - start) / np.hypot(*(end - start))
        across = np.array([-along[1], along[0]])
        base = end - head * along
        self._line(start, base, FORCE, 3)
        self._polygon([end, base + 0.5 * head * across, base - 0.5 * head * across], FORCE)

    def _write(self, picture: pygame.Surface, text: str) -> None:
        """The caption on a strip of its own, large enough to be read in a picture half as wide."""
        if self._font is None:
            pygame.font.init()
            self._font = pygame.font.Font(None, 38)
        pygame.draw.rect(picture, CAPTION, (0, 0, SIZE[0], CAPTION_HEIGHT))
        picture.blit(self._font.render(text, True, TEXT), (10, 6))

    def _line(self, start: Any, end: Any, colour: Any, width: int) -> None:
        ends = self._camera.pixel(start), self._camera.pixel(end)
        pygame.draw.line(self._surface, colour, *ends, width * OVERSAMPLING)

    def _disc(self, centre: Any, radius: float, colour: Any) -> None:
        pygame.draw.circle(self._surface, colour, self._camera.pixel(centre), radius * self._camera.scale)

    def _polygon(self, corners: Any, colour: Any) -> None:
        pygame.draw.polygon(self._surface, colour, [self._camera.pixel(corner) for corner in corners])
