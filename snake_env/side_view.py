"""Two views of one robot in space: from above, and in a strip below from the side, where lifting shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pygame
from numpy.typing import NDArray

from snake_env.rendering import (
    BODY,
    FORCE,
    GRID,
    HEAD,
    OUTLINE,
    OVERSAMPLING,
    SIZE,
    Point,
    TopView,
)

STRIP_HEIGHT = 110
"""Height of the side view [pixels]."""
GROUND_LEVEL = 22
"""Height of the ground line in the strip [pixels]."""
STRIP = (250, 249, 245)
NORMAL_FORCE_SCALE = 0.004
"""Length of a line under a link that the ground carries [m/N]."""

CANVAS = (OVERSAMPLING * SIZE[0], OVERSAMPLING * STRIP_HEIGHT)


class TwoViews(TopView):
    """The top view with a strip that looks at the robot across its body; pegs are seen from above alone."""

    def __init__(self) -> None:
        super().__init__()
        self._strip = pygame.Surface(CANVAS)

    def _draw(self, snapshot: dict[str, Any]) -> pygame.Surface:
        self._draw_strip(snapshot)
        picture = pygame.Surface((SIZE[0], SIZE[1] + STRIP_HEIGHT))
        picture.blit(super()._draw(snapshot), (0, 0))
        picture.blit(pygame.transform.smoothscale(self._strip, (SIZE[0], STRIP_HEIGHT)), (0, SIZE[1]))
        return picture

    def _draw_links(self, snapshot: dict[str, Any]) -> None:
        """Each link as a stadium, foreshortened where it points up or down; higher links over lower ones."""
        axis, height = snapshot["axis"], snapshot["position"][:, 2]
        half_length = snapshot["shape"][:, 0] * np.hypot(axis[:, 0], axis[:, 1])
        outline = 2 * OVERSAMPLING / self._camera.scale
        for i in np.argsort(height, kind="stable"):
            pose, radius = snapshot["pose"][i], snapshot["shape"][i, 1]
            self._stadium(pose, half_length[i], radius, OUTLINE)
            self._stadium(pose, half_length[i], radius - outline, _colour(i))

    def _draw_strip(self, snapshot: dict[str, Any]) -> None:
        self._strip.fill(STRIP)
        ground = CANVAS[1] - OVERSAMPLING * GROUND_LEVEL
        pygame.draw.rect(self._strip, GRID, (0, ground, CANVAS[0], CANVAS[1] - ground))
        ahead = _body_direction(snapshot["axis"])
        across = np.array([-ahead[1], ahead[0]])
        places = snapshot["position"] - [*snapshot["centre"], 0.0]
        depth = places[:, :2] @ across
        for i in np.argsort(-depth, kind="stable"):
            centre = np.array([places[i, :2] @ ahead, places[i, 2]])
            axis = np.array([snapshot["axis"][i, :2] @ ahead, snapshot["axis"][i, 2]])
            self._capsule(centre, axis, snapshot["shape"][i], _colour(i))
            self._load(centre, snapshot["normal_force"][i])

    def _capsule(self, centre: NDArray[np.float64], axis: NDArray[np.float64], shape: Any, colour: Any) -> None:
        """Two discs and what lies between them."""
        half_length, radius = shape
        for margin, fill in ((0.0, OUTLINE), (2 * OVERSAMPLING / self._camera.scale, colour)):
            r = radius - margin
            ends = centre + half_length * axis, centre - half_length * axis
            length = np.hypot(*axis)
            if length > 0.0:
                side = r / length * np.array([-axis[1], axis[0]])
                corners = [ends[0] + side, ends[1] + side, ends[1] - side, ends[0] - side]
                pygame.draw.polygon(self._strip, fill, [self._on_strip(corner) for corner in corners])
            for end in ends:
                pygame.draw.circle(self._strip, fill, self._on_strip(end), r * self._camera.scale)

    def _load(self, centre: NDArray[np.float64], force: float) -> None:
        """The ground's normal force as a line below the ground."""
        foot = np.array([centre[0], 0.0])
        ends = self._on_strip(foot), self._on_strip(foot - [0.0, NORMAL_FORCE_SCALE * force])
        if force > 0.0:
            pygame.draw.line(self._strip, FORCE, *ends, 2 * OVERSAMPLING)

    def _on_strip(self, point: Any) -> Point:
        """Pixel of a point given by its place along the body and its height [m]."""
        x, z = np.asarray(point) * self._camera.scale
        return float(CANVAS[0] / 2 + x), float(CANVAS[1] - OVERSAMPLING * GROUND_LEVEL - z)


def _colour(link: int) -> Any:
    return HEAD if link == 0 else BODY[link % 2]


def _body_direction(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean direction of the body seen from above; links point backwards."""
    mean = -axis[:, :2].sum(axis=0)
    length = np.hypot(*mean)
    return mean / length if length > 0.0 else np.array([1.0, 0.0])
