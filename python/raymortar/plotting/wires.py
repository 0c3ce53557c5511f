"""Wires of rigid tools in 3D: curves on the tools, within a box."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..compat import Array
from ..rigid.body import Body
from ..rigid.checked import direction
from ..rigid.implicit import Implicit
from ..rigid.shapes import Cone, Cylinder, Plane, Sphere, Torus
from ..rigid.surface import Surface
from ..rigid.turning import directions_across
from .outlines import COLOUR

# Points along a curve, curves in each direction, points along each side of a grid, and
# slices
_ALONG, _CURVES, _GRID, _SLICES = 241, 13, 101, 7
# All edges are drawn of a surface with at most this many. Of larger ones an edge is
# drawn where its facets meet at this angle or more
_EDGES, _SHARP = 3000, np.radians(25.0)


def wires(body: Body, lower: Array, upper: Array) -> list[Array]:
    """Curves on a tool at its present place, cut to a box.

    Parameters
    ----------
    body
        Body of a 3D problem.
    lower, upper
        Corners of the box, (3,). Length.

    Returns
    -------
    Points (n, 3) along each curve, n > 1.
    """
    R, shift = body.pose_of(body.motion())
    middle = R.T @ (0.5 * (lower + upper) - shift)
    reach = float(np.linalg.norm(upper - lower))
    shape = body.shape
    draw = next(draw for kind, draw in _DRAWN.items() if isinstance(shape, kind))
    found: list[Array] = []
    for curve in draw(shape, middle, reach):
        found += _within(curve @ R.T + shift, lower, upper)
    return found


def draw_wires(axes: Any, curves: Sequence[Array]) -> None:
    """Draw curves of `wires`, and widen the limits of the axes to them.

    Parameters
    ----------
    axes
        Of matplotlib, with ``projection="3d"``.
    """
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    if not curves:
        return
    # matplotlib draws one collection wholly before another, which would hide half of a
    # tool around a body
    axes.computed_zorder = False
    axes.add_collection3d(
        Line3DCollection(curves, colors=COLOUR, lw=0.6, alpha=0.7, zorder=3)
    )
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    points = np.concatenate(curves)
    lower = np.minimum(limits[:, 0], points.min(axis=0))
    upper = np.maximum(limits[:, 1], points.max(axis=0))
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
    axes.set_zlim(lower[2], upper[2])
    axes.set_box_aspect(upper - lower)


def _within(curve: Array, lower: Array, upper: Array) -> Iterator[Array]:
    """Parts of a curve that are inside a box."""
    inside = np.all((curve >= lower) & (curve <= upper), axis=1)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    for begin, end in ends.reshape(-1, 2):
        if end - begin > 1:
            yield curve[begin:end]


def _ring(centre: Array, one: Array, other: Array) -> Array:
    """Points around an ellipse with given half axes."""
    angle = np.linspace(0.0, 2.0 * np.pi, _ALONG)
    return centre + np.outer(np.cos(angle), one) + np.outer(np.sin(angle), other)


def _around(one: Array, other: Array) -> Array:
    """Unit vectors orthogonal to an axis, all around it, (curves, 3)."""
    return _ring(np.zeros(3), one, other)[:: _ALONG // (_CURVES - 1)][:-1]


def _plane(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Lines in two directions, about the point of the plane nearest to the middle."""
    normal = direction("normal", shape.normal)
    foot = middle - ((middle - shape.place) @ normal) * normal
    frame = directions_across(normal)
    t = np.linspace(-reach, reach, 8 * _ALONG)
    for one, other in (frame, frame[::-1]):
        for at in np.linspace(-reach, reach, 2 * _CURVES):
            yield foot + at * one + np.outer(t, other)


def _ball(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Circles of latitude and of longitude, about a pole that is nearest to the middle.
    They are closer together where the box holds little of a large sphere."""
    centre, radius = shape.place, float(shape.radius)
    towards = middle - centre
    size = float(np.linalg.norm(towards))
    axis = towards / size if size > 0.0 else np.array([0.0, 0.0, 1.0])
    one, other = directions_across(axis)
    half = min(np.pi, reach / radius)
    for angle in np.linspace(0.0, half, _CURVES + 1)[1:]:
        across = radius * np.sin(angle)
        yield _ring(
            centre + radius * np.cos(angle) * axis, across * one, across * other
        )
    angle = np.linspace(0.0, half, _ALONG)
    for out in _around(one, other):
        yield centre + radius * (
            np.outer(np.cos(angle), axis) + np.outer(np.sin(angle), out)
        )


def _cylinder(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Circles, and lines along the axis."""
    axis = direction("axis", shape.axis)
    point, radius = shape.place, float(shape.radius)
    foot = point + ((middle - point) @ axis) * axis
    one, other = directions_across(axis)
    for at in np.linspace(-reach, reach, 2 * _CURVES):
        yield _ring(foot + at * axis, radius * one, radius * other)
    t = np.linspace(-reach, reach, 4 * _ALONG)
    for out in _around(one, other):
        yield foot + radius * out + np.outer(t, axis)


def _cone(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Circles, and lines from the tip."""
    axis, tip = direction("axis", shape.axis), shape.place
    c, s = np.cos(shape.half_angle), np.sin(shape.half_angle)
    length = reach + float(np.linalg.norm(middle - tip))
    one, other = directions_across(axis)
    for at in np.linspace(0.0, length, 2 * _CURVES)[1:]:
        yield _ring(tip + at * c * axis, at * s * one, at * s * other)
    t = np.linspace(0.0, length, 4 * _ALONG)
    for out in _around(one, other):
        yield tip + np.outer(t, c * axis + s * out)


def _torus(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Circles both ways."""
    axis, centre = direction("axis", shape.axis), shape.place
    major, minor = float(shape.major), float(shape.minor)
    one, other = directions_across(axis)
    for angle in np.linspace(0.0, 2.0 * np.pi, _CURVES)[:-1]:
        out = major + minor * np.cos(angle)
        yield _ring(centre + minor * np.sin(angle) * axis, out * one, out * other)
    for out in _around(one, other):
        yield _ring(centre + major * out, minor * out, minor * axis)


def _surface(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Edges of the facets, curved if their degree is 2. Of many facets only sharp edges
    and rims."""
    edges, is_flat = _edges(shape)
    if len(edges) > _EDGES:
        edges = edges[~is_flat]
    t = np.linspace(0.0, 1.0, int(np.clip(20 * _EDGES // max(len(edges), 1), 8, 240)))
    if edges.shape[1] == 2:
        functions = np.stack([1.0 - t, t])
    else:
        functions = np.stack([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
    yield from np.einsum("kp,nkd->npd", functions, shape.points[edges])


def _edges(shape: Any) -> tuple[Any, Any]:
    """Nodes of every edge, both ends and in degree 2 the middle, (n, 2 or 3); whether
    its two facets have nearly the same normal, (n,)."""
    facets, x = shape.facets, shape.points
    m, nodes = facets.shape
    count = 3 if nodes in (3, 6) else 4
    corners = facets[:, :count]
    parts = [corners, np.roll(corners, -1, axis=1)]
    if nodes > count:
        parts.append(facets[:, count : 2 * count])
    edges = np.stack(parts, axis=-1).reshape(m * count, -1)
    ends = np.sort(edges[:, :2], axis=1)
    _, first, number = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    number = number.reshape(-1)
    at = x[corners]
    normal = np.cross(at[:, 1] - at[:, 0], at[:, -1] - at[:, 0])
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    # The sum of two unit vectors has the length 2 cos(angle / 2)
    sums = np.zeros((len(first), 3))
    np.add.at(sums, number, normal[np.arange(m * count) // count])
    is_flat = np.linalg.norm(sums, axis=1) > 2.0 * np.cos(0.5 * _SHARP)
    return edges[first], is_flat


def _zero(shape: Any, middle: Array, reach: float) -> Iterator[Array]:
    """Curves on which the function is zero, on slices across each axis."""
    from contourpy import contour_generator

    along = np.linspace(-0.5, 0.5, _GRID) * reach
    for axis in range(3):
        first, second = (a for a in range(3) if a != axis)
        for at in np.linspace(-0.5, 0.5, 2 * _SLICES + 1) * reach:
            x = np.empty((3, _GRID**2))
            x[axis] = middle[axis] + at
            grid = np.meshgrid(middle[first] + along, middle[second] + along)
            x[first], x[second] = (a.ravel() for a in grid)
            values = np.asarray(shape.phi(x), dtype=float).reshape(_GRID, _GRID)
            across, up = grid
            for line in contour_generator(x=across, y=up, z=values).lines(0.0):
                curve = np.full((len(line), 3), middle[axis] + at)
                curve[:, first], curve[:, second] = line.T
                yield curve


_DRAWN: dict[type, Callable[[Any, Array, float], Iterator[Array]]] = {
    Plane: _plane,
    Sphere: _ball,
    Cylinder: _cylinder,
    Cone: _cone,
    Torus: _torus,
    Surface: _surface,
    Implicit: _zero,
}
