"""Curves on rigid tools, for pictures in 2D and in 3D."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..checked import direction
from ..compat import Array
from ..rigid.body import Body
from ..rigid.implicit import Implicit
from ..rigid.shapes import Cylinder, Plane, Sphere, Torus
from ..rigid.surface import Surface

COLOUR = "#7f5539"
# Slices across each axis in 3D; points along the sides of a slice, and of the grid that
# finds where a tool is
_SLICES, _GRID, _COARSE = 9, 121, 31
# All edges are drawn of a surface with at most this many. Of larger ones an edge is
# drawn where its facets meet at this angle or more
_EDGES, _SHARP = 3000, np.radians(25.0)
# Step of differences, as a share of the box
_STEP = 1e-6


def curves(body: Body, lower: Array, upper: Array) -> list[Array]:
    """Find curves on a tool at its present place, inside a box.

    Parameters
    ----------
    body
        Body of a 2D or 3D problem.
    lower, upper
        Corners of the box, (d,). Length.

    Returns
    -------
    Points (n, d) along each curve, n > 1. In 2D they are the outline; in 3D edges of
    facets, or sections across the axes.
    """
    R, shift = body.pose_of(body.motion())
    shape, dim = body.shape, len(lower)
    if isinstance(shape, Surface):
        edges = np.pad(_edges(shape), ((0, 0), (0, 0), (0, 3 - shape.points.shape[1])))
        found = iter(edges @ R.T + shift)
    else:
        found = _sections(lambda x: _level(shape, (x - shift) @ R), lower, upper)
    return [p for curve in found for p in _within(curve[:, :dim], lower, upper)]


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


def _sections(
    level: Callable[[Array], Array], lower: Array, upper: Array
) -> Iterator[Array]:
    """Find curves (n, 3) where a function is zero: its sections by planes in a box."""
    from contourpy import contour_generator

    dim, step = len(lower), _STEP * float(np.linalg.norm(upper - lower))
    if dim == 3:
        lower, upper = _extent(level, lower, upper)
    sides = np.zeros((3, 2))
    sides[:dim] = np.column_stack([lower, upper])
    axes, slices = ((0, 1, 2), _SLICES) if dim == 3 else ((2,), 1)
    for axis in axes:
        one, other = (np.linspace(a, b, _GRID) for a, b in np.delete(sides, axis, 0))
        for at in np.linspace(sides[axis, 0], sides[axis, 1], slices):
            grid = np.stack(np.meshgrid(one, other), axis=-1).reshape(-1, 2)
            values = level(np.insert(grid, axis, at, axis=1)).reshape(_GRID, _GRID)
            for line in contour_generator(one, other, values).lines(0.0):
                yield _onto(level, np.insert(line, axis, at, axis=1), dim, step)


def _extent(
    level: Callable[[Array], Array], lower: Array, upper: Array
) -> tuple[Array, Array]:
    """Find the part of a box that holds what is inside a tool."""
    sides = [np.linspace(a, b, _COARSE) for a, b in zip(lower, upper)]
    x = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 3)
    inside = x[level(x) <= 0.0]
    if not len(inside):
        return lower, upper
    cell = (upper - lower) / (_COARSE - 1)
    return (
        np.maximum(lower, inside.min(axis=0) - cell),
        np.minimum(upper, inside.max(axis=0) + cell),
    )


def _onto(level: Callable[[Array], Array], x: Array, dim: int, step: float) -> Array:
    """Move points (n, 3) that are near a surface onto it, by Newton's method."""
    for _ in range(3):
        sides = step * np.eye(3)[:dim]
        slopes = [(level(x + s) - level(x - s)) / (2.0 * step) for s in sides]
        gradient = np.column_stack(slopes)
        x = x.copy()
        size = np.maximum((gradient**2).sum(axis=1), 1e-300)
        x[:, :dim] -= (level(x) / size)[:, None] * gradient
    return x


def _within(curve: Array, lower: Array, upper: Array) -> Iterator[Array]:
    """Cut a curve to the parts that are inside a box."""
    inside = np.all((curve >= lower) & (curve <= upper), axis=1)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    for begin, end in ends.reshape(-1, 2):
        if end - begin > 1:
            yield curve[begin:end]


def _edges(shape: Surface) -> Array:
    """Points (n, points, d) along the edges of facets; of many facets along sharp edges
    and rims only."""
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
    of_facets = np.stack([p for p in parts if p.size], axis=-1)
    edges = of_facets.reshape(-1, of_facets.shape[-1])
    ends = np.sort(edges[:, :2], axis=1)
    _, first, number = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    if len(first) <= _EDGES:
        return edges[first]
    x = shape.points[corners]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, -1] - x[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # The sum of two unit vectors has the length 2 cos(angle / 2)
    sums = np.zeros((len(first), 3))
    np.add.at(sums, number.reshape(-1), np.repeat(normal, count, axis=0))
    return edges[first[np.linalg.norm(sums, axis=1) <= 2.0 * np.cos(0.5 * _SHARP)]]
