"""Top view of one robot, drawn with pygame: obstacles, links, contact forces, trail, goal line."""

from __future__ import annotations

import itertools
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.config import Scene
from snake_env.obstacles import circles, heights, outlines
from snake_env.picture import Picture
from snake_env.state import State
from snake_env.surfaces import bodies, field_height, fields, mesh

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

with extras():
    import pygame

REFERENCE_WIDTH = 800
"""Width of a picture that shows VIEW_WIDTH at zoom 1 [pixels]."""
OVERSAMPLING = 2
"""Pixels drawn for each pixel of the picture and direction, for smooth edges."""
VIEW_WIDTH = 2.8
"""Width of the ground that is seen there [m]."""
MARGIN = 0.2
"""Ground around everything where all of the scene is shown [m]."""
FORCE_SCALE = 0.012
"""Length of an arrow [m/N]."""

CAPTION_HEIGHT = 36
"""Height of the strip with the caption, at the top [pixels]."""

GROUND = (238, 234, 224)
GRID = (221, 215, 202)
BORDER = (160, 148, 122)
PEG = (120, 128, 138)
LOW = (190, 192, 190)
"""Colour of an obstacle that hardly rises above the ground; the higher, the nearer to that of a peg."""
PIPE = (214, 216, 210)
HALF_SHADE = 0.1
"""Height at which the colour is half way [m]."""
VALLEY = (150, 168, 176)
"""Colour that uneven ground comes near to far below the plane; far above, it is that of a peg."""
LIGHT = (-0.4, 0.5, 0.77)
"""Direction to the light on slopes, a unit vector."""
GRAIN = 8
"""Side of the squares in which uneven ground is drawn, before they are smoothed [pixels drawn]."""
BODY = ((56, 118, 88), (74, 138, 106))
HEAD = (224, 142, 50)
OUTLINE = (32, 60, 46)
TRAIL = (150, 178, 160)
FORCE = (190, 40, 48)
GOAL = (60, 100, 180)
TEXT = (40, 40, 40)
CAPTION = (250, 249, 245)

Point = tuple[float, float]
Array = NDArray[np.float64]


def caption(time: float, distance: float) -> str:
    """Time, distance towards the goal and mean speed in words; what rounds to zero has no sign."""
    speed = distance / time if time > 0.0 else 0.0
    distance, speed = round(distance, 2) + 0.0, round(speed, 2) + 0.0
    return f"t = {time:.2f} s    distance {distance:.2f} m    speed {speed:.2f} m/s"


def shade(height: float | None) -> Any:
    """Colour of an obstacle from its height [m]; None: without end."""
    share = 1.0 if height is None else height / (height + HALF_SHADE)
    return tuple(round(low + share * (high - low)) for low, high in zip(LOW, PEG, strict=True))


def lit(colour: Any, slopes: Any) -> Array:
    """Colours (..., 3) of the ground or of faces in the light, by their slopes along x and y (..., 2)."""
    slopes = np.asarray(slopes, np.float64)
    facing = (LIGHT[2] - slopes @ np.array(LIGHT[:2])) / np.sqrt(1.0 + (slopes**2).sum(axis=-1))
    return np.clip(np.asarray(colour) * (0.4 + 0.6 * facing / LIGHT[2])[..., np.newaxis], 0.0, 255.0)


def earth(height: Array) -> Array:
    """Colours (..., 3) of level ground at a height above the plane (...) [m]."""
    share = (np.abs(height) / (np.abs(height) + 2.0 * HALF_SHADE))[..., np.newaxis]
    far = np.where((height > 0.0)[..., np.newaxis], PEG, VALLEY)
    return GROUND + share * (far - GROUND)


class Camera:
    """Maps the ground to pixels and keeps +y up.

    Attributes:
        canvas: width and height of what is drawn on, with oversampling [pixels].
        scale: pixels of it per metre.
        centre: the point in its middle [m].
        zoom: the picture's times what the user has pressed.
    """

    def __init__(self, picture: Picture) -> None:
        self._picture = picture
        self.canvas = (OVERSAMPLING * picture.size[0], OVERSAMPLING * picture.size[1])
        self.zoom = picture.zoom
        self.scale = 1.0
        self.centre: Array = np.zeros(2)

    def aim(self, state: State, scene: Scene, trail: Trail) -> None:
        """Turns to where the camera of the picture looks."""
        self.scale = OVERSAMPLING * REFERENCE_WIDTH / VIEW_WIDTH * self.zoom
        self.centre = np.asarray(state.position)
        if self._picture.camera == "fixed":
            centre = self._picture.centre
            self.centre = np.asarray(trail.start if centre is None else centre, np.float64)
        elif self._picture.camera == "scene":
            low, high = extent(state, scene, trail)
            self.centre = 0.5 * (low + high)
            room = np.array([self.canvas[0], self.canvas[1] - OVERSAMPLING * 2 * CAPTION_HEIGHT])
            self.scale = float((room / (high - low)).min())

    def places(self, grain: int) -> Array:
        """Points on the ground in the middles of squares of ``grain`` pixels, (columns, rows, 2) [m]."""
        x, y = ((np.arange(-(-size // grain)) + 0.5) * grain - size / 2 for size in self.canvas)
        return self.centre + np.stack(np.meshgrid(x, -y, indexing="ij"), axis=-1) / self.scale

    def pixel(self, point: Any) -> Point:
        """Pixel of a point on the ground [m]."""
        x, y = (np.asarray(point) - self.centre) * self.scale
        return float(self.canvas[0] / 2 + x), float(self.canvas[1] / 2 - y)


def extent(state: State, scene: Scene, trail: Trail) -> tuple[Array, Array]:
    """Lower and upper corner of what robot, start, goal and obstacles take up, with a margin [m]."""
    points = [
        *state.link_position[:, :2],
        trail.start,
        *(corner for line in outlines(scene.obstacles) for corner in line),
        *(corner for one in bodies(scene.obstacles) for corner in mesh(one)[0][:, :2]),
    ]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    discs = [(radius, np.array([x, y])) for radius, x, y in circles(scene.obstacles)]
    if np.isfinite(state.goal).all():
        discs.append((float(state.goal_radius), state.goal))
    for radius, centre in discs:
        low, high = np.minimum(low, centre - radius), np.maximum(high, centre + radius)
    return low - MARGIN, high + MARGIN


class Trail:
    """Where the CG of one robot was in the pictures of the present episode."""

    def __init__(self) -> None:
        self.points: list[NDArray[np.float64]] = []
        self._last_time = float("inf")

    @property
    def start(self) -> Array:
        """The first of them."""
        return self.points[0]

    def follow(self, state: State) -> None:
        """Adds the present place; a new episode begins a new trail."""
        if state.time < self._last_time:
            self.points.clear()
        if state.time != self._last_time:
            self.points.append(state.position)
        self._last_time = float(state.time)


KEYS_OF_ZOOM = {pygame.K_PLUS: 1, pygame.K_EQUALS: 1, pygame.K_KP_PLUS: 1, pygame.K_MINUS: -1, pygame.K_KP_MINUS: -1}
ZOOM_STEP = 1.25


class Window:
    """A window on the screen; where the user closes it, also by the escape key, it stays closed until :meth:`close`.

    The keys + and - zoom.
    """

    def __init__(self) -> None:
        self._surface: Any = None
        self._clock: Any = None
        self._dismissed = False
        self.zoomed = 1.0
        """Factor on the zoom by the keys pressed since the last picture."""

    def show(self, picture: pygame.Surface, frames_per_second: int) -> None:
        """Shows a picture and waits for the time of the next one."""
        if self._dismissed:
            return
        # Another user of pygame may have closed the display.
        if self._surface is None or pygame.display.get_surface() is not self._surface:
            self._open(picture.get_size())
        self._surface.blit(picture, (0, 0))
        pygame.display.flip()
        self._clock.tick(frames_per_second)
        keys = [event.key for event in pygame.event.get(pygame.KEYDOWN)]
        self.zoomed = ZOOM_STEP ** sum(KEYS_OF_ZOOM.get(key, 0) for key in keys)
        if pygame.event.get(pygame.QUIT) or pygame.K_ESCAPE in keys:
            self.close()
            self._dismissed = True

    def _open(self, size: tuple[int, int]) -> None:
        pygame.display.init()
        pygame.display.set_caption("snake_env")
        self._surface = pygame.display.set_mode(size)
        self._clock = pygame.time.Clock()

    def close(self) -> None:
        """Closes it, if it is open."""
        if self._surface is not None:
            pygame.display.quit()
        self._surface, self._dismissed = None, False


class TopView:
    """Draws robots, one picture after another on the same canvas."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture
        self._camera = Camera(picture)
        self._surface = pygame.Surface(self._camera.canvas)

    def zoom(self, factor: float) -> None:
        """Shows less of the ground from now on, by a factor."""
        self._camera.zoom *= factor

    def image(self, state: State, scene: Scene, trail: Trail) -> NDArray[np.uint8]:
        """Picture of one robot (height, width, 3)."""
        pixels = pygame.surfarray.array3d(self.draw(state, scene, trail))
        return np.ascontiguousarray(np.transpose(pixels, (1, 0, 2)))

    def draw(self, state: State, scene: Scene, trail: Trail) -> pygame.Surface:
        """Picture as a surface."""
        trail.follow(state)
        self._camera.aim(state, scene, trail)
        self._surface.fill(GROUND)
        if self._picture.shows("obstacles"):
            self._draw_fields(scene)
        layers = {
            "grid": lambda: self._draw_grid(),
            "goal": lambda: self._draw_goal(state),
            "obstacles": lambda: self._draw_obstacles(scene),
            "trail": lambda: self._draw_trail(trail),
            "links": lambda: self._draw_links(state),
            "forces": lambda: self._draw_forces(state),
        }
        for name, draw in layers.items():
            if self._picture.shows(name):
                draw()
        picture = pygame.transform.smoothscale(self._surface, self._picture.size)
        if self._picture.shows("caption"):
            self._write(picture, caption(float(state.time), float(state.distance)))
        return picture

    def _draw_grid(self, spacing: float = 0.25) -> None:
        width, height = self._camera.canvas
        half = np.array([width, height]) / (2 * self._camera.scale)
        first, last = np.ceil((self._camera.centre - half) / spacing), (self._camera.centre + half) / spacing
        for x in np.arange(first[0], last[0] + 1) * spacing:
            px = self._camera.pixel((x, 0.0))[0]
            pygame.draw.line(self._surface, GRID, (px, 0), (px, height), OVERSAMPLING)
        for y in np.arange(first[1], last[1] + 1) * spacing:
            py = self._camera.pixel((0.0, y))[1]
            pygame.draw.line(self._surface, GRID, (0, py), (width, py), OVERSAMPLING)

    def _draw_goal(self, state: State) -> None:
        """The path, the goal disc, the goal line with the corridor's bounds, or the commanded direction."""
        if len(state.path):
            for start, end in itertools.pairwise(state.path):
                self._line(start, end, GOAL, 4)
            return
        if np.isnan(state.goal_radius):
            direction = np.array([np.cos(state.goal_direction), np.sin(state.goal_direction)])
            self._arrow(state.position, state.position + 0.6 * direction, 0.08, GOAL)
            return
        if state.goal_radius > 0.0:
            self._disc(state.goal, float(state.goal_radius), GOAL)
            self._disc(state.goal, float(state.goal_radius) - 0.02, GROUND)
            return
        (goal, centre_line), half_width = state.goal, state.corridor_half_width
        right, left = centre_line - half_width, centre_line + half_width
        self._line((goal, right), (goal, left), GOAL, 4)
        back = self._camera.centre[0] - self._camera.canvas[0] / self._camera.scale
        for y in (right, left):
            self._line((back, y), (goal, y), BORDER, 3)

    def _draw_fields(self, scene: Scene) -> None:
        """Uneven ground by its height, in the light."""
        places = self._camera.places(GRAIN)
        for field in reversed(fields(scene.obstacles)):
            height, slopes = field_height(field, places)
            coarse = pygame.Surface(places.shape[:2], pygame.SRCALPHA)
            pygame.surfarray.blit_array(coarse, lit(earth(np.nan_to_num(height)), slopes).astype(np.uint8))
            alpha = pygame.surfarray.pixels_alpha(coarse)
            alpha[...] = np.where(np.isnan(height), 0, 255)
            del alpha
            size = [GRAIN * count for count in places.shape[:2]]
            self._surface.blit(pygame.transform.smoothscale(coarse, size), (0, 0))

    def _draw_bodies(self, scene: Scene) -> None:
        """Polyhedra and poles face by face from below, pipes as their outlines with what is in them."""
        faces = []
        for one in bodies(scene.obstacles):
            vertices, triangles = mesh(one)
            corners = vertices[triangles]
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            seen = normal[:, 2] > 1e-6 * np.linalg.norm(normal, axis=1)
            top = float(vertices[:, 2].max())
            for face, up in zip(corners[seen], normal[seen], strict=True):
                colour = PIPE if getattr(one, "inside", False) else lit(shade(max(top, 0.0)), -up[:2] / up[2])
                faces.append((float(face[:, 2].mean()), face[:, :2], colour))
        for _, face, colour in sorted(faces, key=lambda one: one[0]):
            self._polygon(face, colour)

    def _draw_obstacles(self, scene: Scene) -> None:
        self._draw_bodies(scene)
        round_ones, others = heights(scene.obstacles)
        drawn: list[tuple[float | None, Any]] = [
            *zip(round_ones, circles(scene.obstacles), strict=True),
            *zip(others, outlines(scene.obstacles), strict=True),
        ]
        # Higher ones over lower ones: the upper steps of stairs.
        for height, shape in sorted(drawn, key=lambda one: np.inf if one[0] is None else one[0]):
            colour = shade(height)
            if isinstance(shape, tuple):
                radius, x, y = shape
                self._disc((x, y), radius, colour)
                continue
            if len(shape) > 2:
                self._polygon(shape, colour)
            self._line(shape[0], shape[-1], colour, 3)

    def _draw_trail(self, trail: Trail) -> None:
        if len(trail.points) > 1:
            points = [self._camera.pixel(point) for point in trail.points]
            pygame.draw.lines(self._surface, TRAIL, False, points, 2 * OVERSAMPLING)

    def _draw_links(self, state: State) -> None:
        """Each link as a stadium: straight sides and round ends."""
        half_axes = state.link_half_length[:, np.newaxis] * state.link_axis
        links = list(zip(state.link_middle, half_axes, state.link_radius, strict=True))
        outline = 2 * OVERSAMPLING / self._camera.scale
        for place, half_axis, radius in links:
            self._stadium(place, half_axis, radius, OUTLINE)
        for i, (place, half_axis, radius) in reversed(list(enumerate(links))):
            self._stadium(place, half_axis, radius - outline, HEAD if i == 0 else BODY[i % 2])

    def _stadium(self, centre: Array, half_axis: Array, radius: float, colour: Any) -> None:
        half_length = float(np.hypot(*half_axis))
        along = half_axis / half_length if half_length > 0.0 else np.array([1.0, 0.0])
        across = np.array([-along[1], along[0]])
        ends = centre + half_length * along, centre - half_length * along
        corners = [end + side * radius * across for end, side in zip((*ends, *ends[::-1]), (1, 1, -1, -1), strict=True)]
        self._polygon(corners, colour)
        for end in ends:
            self._disc(end, radius, colour)

    def _draw_forces(self, state: State) -> None:
        """The mean force of the pegs on each link during the last control period."""
        for place, force in zip(state.link_position[:, :2], state.contact_force[:, :2], strict=True):
            if np.hypot(*force) * FORCE_SCALE > 0.005:
                self._arrow(place, place + FORCE_SCALE * force)

    def _arrow(self, start: Array, end: Array, head: float = 0.04, colour: Any = FORCE) -> None:
        along = (end - start) / np.hypot(*(end - start))
        across = np.array([-along[1], along[0]])
        base = end - head * along
        self._line(start, base, colour, 3)
        self._polygon([end, base + 0.5 * head * across, base - 0.5 * head * across], colour)

    def _write(self, picture: pygame.Surface, text: str) -> None:
        """The caption on a strip of its own, large enough to be read in a picture half as wide."""
        # A font kept from the last picture would be lost where another user of pygame has called pygame.quit.
        pygame.font.init()
        width = self._picture.size[0]
        font = pygame.font.Font(None, max(10, min(38, 38 * width // 640)))
        pygame.draw.rect(picture, CAPTION, (0, 0, width, CAPTION_HEIGHT))
        picture.blit(font.render(text, True, TEXT), (10, 6))

    def _line(self, start: Any, end: Any, colour: Any, width: int) -> None:
        ends = self._camera.pixel(start), self._camera.pixel(end)
        pygame.draw.line(self._surface, colour, *ends, width * OVERSAMPLING)

    def _disc(self, centre: Any, radius: float, colour: Any) -> None:
        pygame.draw.circle(self._surface, colour, self._camera.pixel(centre), radius * self._camera.scale)

    def _polygon(self, corners: Any, colour: Any) -> None:
        pygame.draw.polygon(self._surface, colour, [self._camera.pixel(corner) for corner in corners])
