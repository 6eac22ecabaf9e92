"""Surfaces of height fields, convex polyhedra and cylinders as triangles, for pictures; lengths in m."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.obstacles import Cylinder, HeightField, Polyhedron

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]
"""Vertices (k, 3), and triangles (m, 3) of them, anticlockwise seen from outside."""

SIDES = 32
"""Of the prism that stands for a cylinder."""
FLAT = 1e-9
"""Round-off of a length, relative to the size of a polyhedron."""


def bodies(obstacles: Sequence[Any]) -> list[Polyhedron | Cylinder]:
    """The obstacles that are neither vertical nor a field."""
    return [one for one in obstacles if isinstance(one, Polyhedron | Cylinder)]


def fields(obstacles: Sequence[Any]) -> list[HeightField]:
    """The height fields."""
    return [one for one in obstacles if isinstance(one, HeightField)]


def mesh(obstacle: Any) -> Mesh:
    """Of a field, a polyhedron or a cylinder; a pipe is open at its ends."""
    if isinstance(obstacle, HeightField):
        return _field(obstacle)
    if isinstance(obstacle, Cylinder):
        return _cylinder(obstacle)
    points = np.asarray(obstacle.vertices, np.float64)
    return points, _hull(tuple(map(tuple, points.tolist())))


def ground_height(obstacles: Sequence[Any], points: Any) -> Array:
    """Height of the ground at points (..., 2): of the first field there, or else of the plane (...)."""
    points = np.asarray(points, np.float64)
    found = np.full(points.shape[:-1], np.nan)
    for one in fields(obstacles):
        found = np.where(np.isnan(found), field_height(one, points)[0], found)
    return np.nan_to_num(found)


def field_height(field: HeightField, points: Array) -> tuple[Array, Array]:
    """Height (...) and slopes (..., 2) of a field at points (..., 2), nan beside it."""
    height = np.asarray(field.height, np.float64)
    cells = np.array(height.shape) - 1
    local = (points - np.asarray(field.origin)) / field.spacing
    with np.errstate(invalid="ignore"):
        is_over = ((local >= 0.0) & (local <= cells)).all(axis=-1)
        cell = np.clip(np.nan_to_num(local), 0, cells - 1).astype(int)
    i, j = cell[..., 0], cell[..., 1]
    x, y = np.moveaxis(local - cell, -1, 0)
    near, far = height[i, j], height[i + 1, j + 1]
    right, left = height[i + 1, j], height[i, j + 1]
    rise_x = np.where(y <= x, right - near, far - left)
    rise_y = np.where(y <= x, far - right, left - near)
    slopes = np.stack([rise_x, rise_y], axis=-1) / field.spacing
    return np.where(is_over, near + rise_x * x + rise_y * y, np.nan), slopes


def section(obstacle: Any, origin: Array, along: Array) -> Array:
    """Outline (k, 2) of a convex body cut by the upright plane through ``origin`` (2,) along a unit vector (2,).

    Coordinates are those along the vector from the origin, and heights; empty where the plane passes by.
    """
    vertices, triangles = mesh(obstacle)
    across = np.array([-along[1], along[0]])
    depth = (vertices[:, :2] - origin) @ across
    edges = np.concatenate([triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
    first, second = depth[edges].T
    cut = edges[(first > 0.0) != (second > 0.0)]
    if len(cut) < 3:
        return np.empty((0, 2))
    share = (depth[cut[:, 0]] / (depth[cut[:, 0]] - depth[cut[:, 1]]))[:, np.newaxis]
    points = vertices[cut[:, 0]] + share * (vertices[cut[:, 1]] - vertices[cut[:, 0]])
    flat = np.stack([(points[:, :2] - origin) @ along, points[:, 2]], axis=1)
    offset = flat - flat.mean(axis=0)
    return flat[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))]


def _field(field: HeightField) -> Mesh:
    """Its triangles, and upright ones from its border to the plane."""
    height = np.asarray(field.height, np.float64)
    rows = [origin + field.spacing * np.arange(n) for origin, n in zip(field.origin, height.shape, strict=True)]
    vertices = np.stack([*np.meshgrid(*rows, indexing="ij"), height], axis=-1)
    number = np.arange(height.size).reshape(height.shape)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    near, right, far, left = (corner.ravel() for corner in corners)
    top = np.concatenate([np.stack([near, right, far], axis=1), np.stack([near, far, left], axis=1)])
    border = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    feet = vertices.reshape(-1, 3)[border] * [1.0, 1.0, 0.0]
    foot = height.size + np.arange(len(border))
    following, next_foot = np.roll(border, -1), np.roll(foot, -1)
    walls = np.concatenate([np.stack([border, foot, next_foot], 1), np.stack([border, next_foot, following], 1)])
    return np.concatenate([vertices.reshape(-1, 3), feet]), np.concatenate([top, walls])


def _cylinder(cylinder: Cylinder) -> Mesh:
    start, end = np.asarray(cylinder.start, np.float64), np.asarray(cylinder.end, np.float64)
    axis = (end - start) / np.linalg.norm(end - start)
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rim = cylinder.radius * (np.outer(np.cos(turn), across) + np.outer(np.sin(turn), np.cross(axis, across)))
    k = np.arange(SIDES)
    after = (k + 1) % SIDES
    triangles = [np.stack([k, after, after + SIDES], 1), np.stack([k, after + SIDES, k + SIDES], 1)]
    if not cylinder.inside:
        triangles += [np.stack([np.zeros_like(k), after, k], 1), SIDES + np.stack([np.zeros_like(k), k, after], 1)]
    return np.concatenate([start + rim, end + rim]), np.concatenate(triangles)


@lru_cache(maxsize=4096)
def _hull(vertices: tuple[tuple[float, float, float], ...]) -> NDArray[np.int64]:
    """Triangles of the convex hull: planes through three points that have all others on one side, each a fan."""
    points = np.array(vertices)
    flat = FLAT * float(np.ptp(points, axis=0).max())
    triples = np.array(list(itertools.combinations(range(len(points)), 3)))
    a, b, c = (points[triples[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    normal, a = normal[size > flat * flat] / size[size > flat * flat, np.newaxis], a[size > flat * flat]
    height = normal @ points.T - np.einsum("ij,ij->i", normal, a)[:, np.newaxis]
    faces: dict[tuple[int, ...], Array] = {}
    for side in (1.0, -1.0):
        for plane in np.flatnonzero((side * height).max(axis=1) <= flat):
            faces[tuple(np.flatnonzero(side * height[plane] >= -flat))] = side * normal[plane]
    return np.concatenate([_fan(points, np.array(on), outward) for on, outward in faces.items()])


def _fan(points: Array, on: NDArray[np.int64], outward: Array) -> NDArray[np.int64]:
    """Triangles of a flat face from its points, anticlockwise seen against its normal."""
    offset = points[on] - points[on].mean(axis=0)
    first = offset[np.argmax(np.linalg.norm(offset, axis=1))]
    first /= np.linalg.norm(first)
    order = on[np.argsort(np.arctan2(offset @ np.cross(outward, first), offset @ first))]
    return np.stack([np.full(len(on) - 2, order[0]), order[1:-1], order[2:]], axis=1)
