"""Outlines of rigid tools in 2D."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..compat import Array
from ..rigid.body import Body
from ..rigid.implicit import Implicit
from ..rigid.shapes import Cone, Plane, Sphere
from ..rigid.surface import Surface

# Points along a curve, and along each side of the grid on which zeros of a function are
# found
_ALONG, _GRID = 241, 201
COLOUR = "#7f5539"


def outlines(body: Body, lower: Array, upper: Array) -> list[Array]:
    """Curves of a tool at its present place. They cover at least a box.

    Parameters
    ----------
    body
        Body of a 2D problem.
    lower, upper
        Corners of the box, (2,). Length.

    Returns
    -------
    Points (n, 2) along each curve.
    """
    R, shift = body.pose_of(body.motion())
    turn = R[:2, :2]
    middle = turn.T @ (0.5 * (lower + upper) - shift[:2])
    reach = float(np.linalg.norm(upper - lower))
    shape = body.shape
    draw = next(draw for kind, draw in _DRAWN.items() if isinstance(shape, kind))
    return [line @ turn.T + shift[:2] for line in draw(shape, middle, reach)]


def draw_tools(axes: Any, bodies: Sequence[Body], lower: Array, upper: Array) -> None:
    """Draw outlines, and set the limits of the axes to a box.

    Parameters
    ----------
    axes
        Of matplotlib.
    """
    for body in bodies:
        for curve in outlines(body, lower, upper):
            axes.plot(*curve.T, color=COLOUR, lw=1.2, zorder=3)
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))


def _line(shape: Any, middle: Array, reach: float) -> list[Array]:
    """A segment of the line, about its point nearest to the middle."""
    normal = np.asarray(shape.normal, dtype=float)
    normal = normal / np.abs(normal).max()
    along = np.array([-normal[1], normal[0]]) / np.linalg.norm(normal)
    point = np.asarray(shape.point, dtype=float)
    foot = point + ((middle - point) @ along) * along
    return [foot + np.outer([-reach, reach], along)]


def _circle(shape: Any, middle: Array, reach: float) -> list[Array]:
    """The circle, or its arc nearest to the middle."""
    centre, radius = np.asarray(shape.centre, dtype=float), float(shape.radius)
    half = min(np.pi, 2.0 * reach / radius)
    towards = middle - centre
    start = np.arctan2(towards[1], towards[0])
    angle = start + np.linspace(-half, half, _ALONG)
    return [centre + radius * np.column_stack([np.cos(angle), np.sin(angle)])]


def _wedge(shape: Any, middle: Array, reach: float) -> list[Array]:
    """One flank, the tip, the other flank."""
    tip, axis = (np.asarray(x, dtype=float) for x in (shape.tip, shape.axis))
    axis = axis / np.abs(axis).max()
    axis = axis / np.linalg.norm(axis)
    across = np.array([-axis[1], axis[0]])
    length = reach + float(np.linalg.norm(middle - tip))
    c, s = np.cos(shape.half_angle), np.sin(shape.half_angle)
    flanks = [tip + length * (c * axis + sign * s * across) for sign in (1.0, -1.0)]
    return [np.array([flanks[0], tip, flanks[1]])]


def _surface(shape: Any, middle: Array, reach: float) -> list[Array]:
    """One curve for each facet, curved if its degree is 2."""
    nodes = shape.points[shape.facets]
    if nodes.shape[1] == 2:
        return list(nodes)
    t = np.linspace(0.0, 1.0, 9)
    functions = np.stack([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
    return list(np.einsum("kp,nkd->npd", functions, nodes))


def _zero(shape: Any, middle: Array, reach: float) -> list[Array]:
    """Curves on which the function is zero."""
    from contourpy import contour_generator

    x, y = (c + np.linspace(-0.5, 0.5, _GRID) * reach for c in middle)
    at = np.stack([*(a.ravel() for a in np.meshgrid(x, y)), np.zeros(_GRID**2)])
    values = np.asarray(shape.phi(at), dtype=float).reshape(_GRID, _GRID)
    return list(contour_generator(x, y, values).lines(0.0))


_DRAWN: dict[type, Callable[[Any, Array, float], list[Array]]] = {
    Plane: _line,
    Sphere: _circle,
    Cone: _wedge,
    Surface: _surface,
    Implicit: _zero,
}
