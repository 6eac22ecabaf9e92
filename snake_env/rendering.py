"""Top view of one robot, drawn with pygame: obstacles, links, contact forces, trail, goal line."""

from __future__ import annotations

import itertools
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.config import Scene
from snake_env.obstacles import balls, circles, heights, outlines, springs
from snake_env.palette import (
    BODY,
    FORCE,
    GOAL,
    GRID,
    GROUND,
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
    tint,
)
from snake_env.picture import Picture
from snake_env.state import State
from snake_env.surfaces import bodies, field_height, fields, ground_height, mesh

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
CAPTION_HEIGHT = 36
"""Height of the strip with the caption, at the top [pixels]."""
NICE = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
"""Forces of which one shows how long arrows are [N]."""

BORDER = (150, 156, 148)
LOW = (205, 208, 206)
"""Colour of an obstacle that hardly rises above the ground; the higher, the nearer to that of a peg."""
PIPE = (216, 220, 218)
HALF_SHADE = 0.1
"""Height at which the colour is half way [m]."""
VALLEY = (150, 168, 176)
"""Colour that uneven ground comes near to far below the plane; far above, it is that of a peg."""
GRAIN = 8
"""Side of the squares in which uneven ground is drawn, before they are smoothed [pixels drawn]."""
SHADED = 0.82
"""Light that is left in a shadow."""
HIGHEST_SHADOW = 0.25
"""Height from which on links cast none, as on a pole [m]."""
EDGE = 0.66
"""Light on the rim of a link."""
TEXT = (40, 40, 40)
CAPTION = (252, 252, 250)

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
    facing = (SUN[2] - slopes @ np.array(SUN[:2])) / np.sqrt(1.0 + (slopes**2).sum(axis=-1))
    return np.clip(np.asarray(colour) * (0.4 + 0.6 * facing / SUN[2])[..., np.newaxis], 0.0, 255.0)


def dim(colour: Any, light: float) -> Any:
    """A colour in less light."""
    return tuple(round(light * value) for value in colour)


def earth(height: Array) -> Array:
    """Colours (..., 3) of level ground at a height above the plane (...) [m]."""
    share = (np.abs(height) / (np.abs(height) + 2.0 * HALF_SHADE))[..., np.newaxis]
    far = np.where((height > 0.0)[..., np.newaxis], PEG, VALLEY)
    return np.array(GROUND) + share * (far - np.array(GROUND))


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
        *(np.asarray(corner) for patch in scene.patches for corner in patch.vertices),
        *(corner for one in bodies(scene.obstacles) for corner in mesh(one)[0][:, :2]),
    ]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    round_ones = [*circles(scene.obstacles), *balls(scene.obstacles)[:, :3]]
    discs = [(radius, np.array([x, y])) for radius, x, y in round_ones]
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
        self._shadow = pygame.Surface(self._camera.canvas)

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
        held = springs(scene.obstacles, state.obstacle_position)
        scene = scene.with_obstacles_at(state.obstacle_position, state.obstacle_angle, state.obstacle_height)
        self._camera.aim(state, scene, trail)
        self._surface.fill(GROUND)
        if self._picture.shows("obstacles"):
            for patch in scene.patches:
                self._polygon(np.array(patch.vertices), tint(patch.factor))
            self._draw_fields(scene)
        layers = {
            "grid": lambda: self._draw_grid(),
            "goal": lambda: self._draw_goal(state),
            "obstacles": lambda: self._draw_obstacles(scene, held),
            "trail": lambda: self._draw_trail(trail),
            "links": lambda: self._draw_links(state),
            "forces": lambda: self._draw_forces(state),
        }
        for name, draw in layers.items():
            if name == "obstacles":
                self._draw_shadows(state, scene)
            if self._picture.shows(name):
                draw()
        picture = pygame.transform.smoothscale(self._surface, self._picture.size)
        if self._picture.shows("caption"):
            self._write(picture, caption(float(state.time), float(state.distance)))
            if self._picture.shows("forces") and scene.obstacles:
                self._write_scale(picture)
        return picture

    def _draw_grid(self) -> None:
        width, height = self._camera.canvas
        half = np.array([width, height]) / (2 * self._camera.scale)
        for spacing, colour, wide in ((0.1, GRID[0], 1), (1.0, GRID[1], 2)):
            first, last = np.ceil((self._camera.centre - half) / spacing), (self._camera.centre + half) / spacing
            for x in np.arange(first[0], last[0] + 1) * spacing:
                px = self._camera.pixel((x, 0.0))[0]
                pygame.draw.line(self._surface, colour, (px, 0), (px, height), wide * OVERSAMPLING)
            for y in np.arange(first[1], last[1] + 1) * spacing:
                py = self._camera.pixel((0.0, y))[1]
                pygame.draw.line(self._surface, colour, (0, py), (width, py), wide * OVERSAMPLING)

    def _draw_shadows(self, state: State, scene: Scene) -> None:
        """Of upright obstacles, of balls and of links, the farther from these the higher they are above the plane."""
        self._shadow.fill((255, 255, 255))
        dark = dim((255, 255, 255), SHADED)
        away = -np.array(SUN[:2]) / SUN[2]
        if self._picture.shows("obstacles"):
            round_ones, others = heights(scene.obstacles)
            for height, (radius, x, y) in zip(round_ones, circles(scene.obstacles), strict=True):
                cast = 0.5 * away * (PEG_HEIGHT if height is None else height)
                self._stadium(np.array([x, y]) + cast, cast, radius, dark, self._shadow)
            for height, line in zip(others, outlines(scene.obstacles), strict=True):
                cast = away * (PEG_HEIGHT if height is None else height)
                for start, end in zip(line, [*line[1:], line[0]], strict=True):
                    corners = [start, end, end + cast, start + cast]
                    pygame.draw.polygon(self._shadow, dark, [self._camera.pixel(corner) for corner in corners])
            for radius, *place, height in balls(scene.obstacles):
                self._disc(np.array(place) + away * height, radius, dark, self._shadow)
        if self._picture.shows("links"):
            places, half_axes = state.link_middle, state.link_half_length[:, np.newaxis] * state.link_axis[:, :2]
            up = np.array(places[:, 2]) if places.shape[1] == 3 else state.link_radius
            if self._picture.shows("obstacles"):
                up = up - ground_height(scene.obstacles, places[:, :2])
            for k in np.flatnonzero(up < HIGHEST_SHADOW):
                radius = float(state.link_radius[k])
                self._stadium(places[k, :2] + away * up[k], half_axes[k], radius, dark, self._shadow)
        self._surface.blit(self._shadow, (0, 0), special_flags=pygame.BLEND_RGB_MULT)

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

    def _draw_obstacles(self, scene: Scene, held: Array) -> None:
        """And springs, a line each from where it holds a peg to the peg's centre."""
        self._draw_bodies(scene)
        round_ones, others = heights(scene.obstacles)
        drawn: list[tuple[float | None, Any]] = [
            *zip(round_ones, circles(scene.obstacles), strict=True),
            *zip(others, outlines(scene.obstacles), strict=True),
            *((one[0] + one[3], tuple(one)) for one in balls(scene.obstacles)),
        ]
        # Higher ones over lower ones: the upper steps of stairs.
        for height, shape in sorted(drawn, key=lambda one: np.inf if one[0] is None else one[0]):
            colour = shade(height)
            if isinstance(shape, tuple):
                radius, x, y, *is_ball = shape
                self._disc((x, y), radius, dim(PEG, EDGE) if is_ball else colour)
                if is_ball:
                    self._disc((x, y), 0.86 * radius, PEG)
                continue
            if len(shape) > 2:
                self._polygon(shape, colour)
            self._line(shape[0], shape[-1], colour, 3)
        for home, place in held:
            self._line(home, place, SPRING, 4)
            self._disc(home, SPRING_WIDTH, SPRING)

    def _draw_trail(self, trail: Trail) -> None:
        if len(trail.points) > 1:
            points = [self._camera.pixel(point) for point in trail.points]
            pygame.draw.lines(self._surface, TRAIL, False, points, 2 * OVERSAMPLING)

    def _draw_links(self, state: State) -> None:
        """Each link as a stadium, foreshortened where it points up or down; higher links over lower ones."""
        height = state.link_middle[:, 2] if state.link_middle.shape[1] == 3 else -np.arange(len(state.link_radius))
        for i in np.argsort(height, kind="stable"):
            place, half_axis = state.link_middle[i, :2], state.link_half_length[i] * state.link_axis[i, :2]
            radius = float(state.link_radius[i])
            colour = colour_of(i)
            self._stadium(place, half_axis, radius, dim(colour, EDGE))
            self._stadium(place, half_axis, 0.86 * radius, colour)
            back = state.link_back[i]
            if back[2] > 0.1:
                self._stadium(
                    place + radius * back[:2], 0.7 * half_axis, 0.5 * MARK_WIDTH * radius * float(back[2]), MARK
                )

    def _stadium(self, centre: Array, half_axis: Array, radius: float, colour: Any, surface: Any = None) -> None:
        half_length = float(np.hypot(*half_axis))
        along = half_axis / half_length if half_length > 0.0 else np.array([1.0, 0.0])
        across = np.array([-along[1], along[0]])
        ends = centre + half_length * along, centre - half_length * along
        corners = [end + side * radius * across for end, side in zip((*ends, *ends[::-1]), (1, 1, -1, -1), strict=True)]
        self._polygon(corners, colour, surface)
        for end in ends:
            self._disc(end, radius, colour, surface)

    def _draw_forces(self, state: State) -> None:
        """The mean force of the pegs on each link during the last control period."""
        scale = self._picture.force_scale
        for place, force in zip(state.link_position[:, :2], state.contact_force[:, :2], strict=True):
            size = float(np.hypot(*force))
            if size * scale > 0.005:
                along = force / size
                end = place + min(scale * size, LONGEST_ARROW) * along
                self._arrow(place, end)
                if scale * size > LONGEST_ARROW:
                    self._arrow(place, end - 0.03 * along)

    def _arrow(self, start: Array, end: Array, head: float = 0.04, colour: Any = FORCE) -> None:
        along = (end - start) / np.hypot(*(end - start))
        across = np.array([-along[1], along[0]])
        base = end - head * along
        self._line(start, base, colour, 3)
        self._polygon([end, base + 0.5 * head * across, base - 0.5 * head * across], colour)

    def _write(self, picture: pygame.Surface, text: str) -> None:
        """The caption on a strip of its own, large enough to be read in a picture half as wide."""
        pygame.draw.rect(picture, CAPTION, (0, 0, self._picture.size[0], CAPTION_HEIGHT))
        self._put(picture, text, 10)

    def _write_scale(self, picture: pygame.Surface) -> None:
        """An arrow in the caption, and the force that it stands for."""
        width = self._picture.size[0]
        per_newton = self._picture.force_scale * self._camera.scale / OVERSAMPLING
        force = max((one for one in NICE if one * per_newton <= 0.1 * width), default=NICE[0])
        text = f"{force} N"
        left = self._put(picture, text, None)
        end, length, y = left - 8, force * per_newton, CAPTION_HEIGHT // 2
        pygame.draw.line(picture, FORCE, (end - length, y), (end - 6, y), 2)
        pygame.draw.polygon(picture, FORCE, [(end, y), (end - 9, y - 5), (end - 9, y + 5)])

    def _put(self, picture: pygame.Surface, text: str, left: int | None) -> int:
        """Writes into the strip of the caption from a place on, or up to its right end; returns where it begins."""
        # A font kept from the last picture would be lost where another user of pygame has called pygame.quit.
        pygame.font.init()
        width = self._picture.size[0]
        font = pygame.font.Font(None, OVERSAMPLING * max(10, min(30, 30 * width // 640)))
        large = font.render(text, True, TEXT)
        size = large.get_width() // OVERSAMPLING, large.get_height() // OVERSAMPLING
        left = width - 10 - size[0] if left is None else left
        picture.blit(pygame.transform.smoothscale(large, size), (left, (CAPTION_HEIGHT - size[1]) // 2))
        return left

    def _line(self, start: Any, end: Any, colour: Any, width: int) -> None:
        ends = self._camera.pixel(start), self._camera.pixel(end)
        pygame.draw.line(self._surface, colour, *ends, width * OVERSAMPLING)

    def _disc(self, centre: Any, radius: float, colour: Any, surface: Any = None) -> None:
        pygame.draw.circle(surface or self._surface, colour, self._camera.pixel(centre), radius * self._camera.scale)

    def _polygon(self, corners: Any, colour: Any, surface: Any = None) -> None:
        pygame.draw.polygon(surface or self._surface, colour, [self._camera.pixel(corner) for corner in corners])


def colour_of(link: int) -> Any:
    """Of a link."""
    return HEAD if link == 0 else BODY[link % 2]
