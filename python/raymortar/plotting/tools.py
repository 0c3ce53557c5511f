"""Curves on rigid tools, for pictures in 2D and in 3D."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..arguments import direction
from ..core.compat import Array
from ..rigid.body import Body
from ..rigid.implicit import Implicit
from ..rigid.shapes import Cylinder, Plane, Sphere, Torus
from ..rigid.surface import Surface, edges_of

COLOUR = "#7f5539"
# Slices across each axis in 3D; points along the sides of a slice, and of the grid that
# finds where a tool is
_SLICES, _GRID, _COARSE = 9, 121, 31
# All edges are drawn of a surface with at most this many. Of larger ones an edge is
# drawn where its facets meet at this angle or more
_EDGES, _SHARP = 3000, np.radians(25.0)
# Step of differences, as a share of the box
_STEP = 1e-6

Level = Callable[[Array], Array]


def curves(body: Body, lower: Array, upper: Array) -> list[Array]:
    """Find curves on a tool at its present place, inside a box with two corners (d,).

    Points (n, d) along each curve, n > 1. In 2D they are the outline; in 3D edges of
    facets, or sections across the axes.
    """
    R, shift = body.pose_of(body.motion())
    shape, dim, found = body.shape, len(lower), []
    if not body.has_surface:
        return []
    if isinstance(shape, Surface):
        edges = np.pad(_edges(shape), ((0, 0), (0, 0), (0, 3 - shape.points.shape[1])))
        lines = iter(edges @ R.T + shift)
    else:
        lines = _sections(lambda x: _level(shape, (x - shift) @ R), lower, upper)
    for x in (line[:, :dim] for line in lines):
        inside = np.all((x >= lower) & (x <= upper), axis=1)
        if dim == 2:  # lines that pass have no point inside; axes cut them
            low, high = np.minimum(x[1:], x[:-1]), np.maximum(x[1:], x[:-1])
            meets = np.all((low <= upper) & (high >= lower), axis=1)
            inside = np.append(meets, False) | np.append(False, meets)
        parts = np.split(x, np.flatnonzero(np.diff(inside)) + 1)
        found += [one for one in parts[not inside[0] :: 2] if len(one) > 1]
    return found


def _level(shape: Any, x: Array) -> Array:
    """Evaluate a function that is zero on a shape, at points (n, 3)."""
    if isinstance(shape, Implicit):
        return np.asarray(shape.phi(x.T.copy()), dtype=float)
    r = x - shape.place
    if isinstance(shape, Plane):
        return r @ direction("normal", shape.normal)
    if isinstance(shape, Sphere):
        return np.linalg.norm(r, axis=1) - shape.radius
    axis = direction("axis", shape.axis)
    along = r @ axis
    across = np.linalg.norm(r - np.outer(along, axis), axis=1)
    if isinstance(shape, Cylinder):
        return across - shape.radius
    if isinstance(shape, Torus):
        return np.hypot(across - shape.major, along) - shape.minor
    return across * np.cos(shape.half_angle) - along * np.sin(shape.half_angle)


def _sections(level: Level, lower: Array, upper: Array) -> Iterator[Array]:
    """Find curves (n, 3) where a function is zero: its sections by planes in a box."""
    from contourpy import contour_generator

    steps = _STEP * np.linalg.norm(upper - lower) * np.eye(3)[: len(lower)]
    sides: Any = np.zeros((3, 2))
    sides[: len(lower)] = np.column_stack([lower, upper])
    # The part of the box that holds the tool
    count = _COARSE if len(lower) == 3 else _GRID
    grid = np.meshgrid(*(np.linspace(a, b, count) for a, b in sides[: len(lower)]))
    x = np.zeros((grid[0].size, 3))
    x[:, : len(lower)] = np.stack(grid, axis=-1).reshape(len(x), -1)
    inside = x[level(x) <= 0.0, : len(lower)]
    if len(inside):
        cell = (upper - lower) / (count - 1)
        sides[: len(lower), 0] = np.maximum(lower, inside.min(axis=0) - cell)
        sides[: len(lower), 1] = np.minimum(upper, inside.max(axis=0) + cell)
    for axis in range(3) if len(lower) == 3 else [2]:
        one, other = (np.linspace(a, b, _GRID) for a, b in np.delete(sides, axis, 0))
        plane = np.stack(np.meshgrid(one, other), axis=-1).reshape(-1, 2)
        for at in np.unique(np.linspace(sides[axis, 0], sides[axis, 1], _SLICES)):
            values = level(np.insert(plane, axis, at, axis=1)).reshape(_GRID, _GRID)
            for line in contour_generator(one, other, values).lines(0.0):
                x = np.insert(line, axis, at, axis=1)
                for _ in range(3):  # onto the surface, by Newton's method
                    slopes = np.stack(
                        [level(x + s) - level(x - s) for s in steps], axis=1
                    )
                    size = np.maximum((slopes**2).sum(axis=1), 1e-300)
                    x = x - (2.0 * level(x) / size)[:, None] * (slopes @ steps)
                yield x


def _edges(shape: Surface) -> Array:
    """Points (n, points, d) along edges of facets, of many along sharp ones and rims."""
    nodes = shape.facets if shape.points.shape[1] == 2 else _edges_in_space(shape)
    t = np.linspace(0.0, 1.0, int(np.clip(20 * _EDGES // max(len(nodes), 1), 8, 240)))
    if nodes.shape[1] == 2:
        functions = np.stack([1.0 - t, t])
    else:
        functions = np.stack([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
    return np.einsum("kp,nkd->npd", functions, shape.points[nodes])


def _edges_in_space(shape: Surface) -> Any:
    """Nodes of edges, both ends and in degree 2 the middle, (n, 2 or 3)."""
    facets, count = shape.facets, 3 if shape.facets.shape[1] in (3, 6) else 4
    corners = facets[:, :count]
    parts = [corners, np.roll(corners, -1, axis=1), facets[:, count : 2 * count]]
    edges = np.stack([p.ravel() for p in parts if p.size], axis=1)
    number = edges_of(corners)[0].ravel()
    _, first = np.unique(number, return_index=True)
    if len(first) <= _EDGES:
        return edges[first]
    x = shape.points[corners]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, -1] - x[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # The sum of two unit vectors has the length 2 cos(angle / 2)
    sums = np.zeros((len(first), 3))
    np.add.at(sums, number, np.repeat(normal, count, axis=0))
    return edges[first[np.linalg.norm(sums, axis=1) <= 2.0 * np.cos(0.5 * _SHARP)]]
