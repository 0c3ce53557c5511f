"""Tools in 2D from straight lines, whose corners are rounded by a radius."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.errors import ContactError, format_point, truth
from .shapes import Vector
from .surface import Surface, checked_points

# Largest angle of a facet of a fillet. Its radius is exact to 2.3e-6, its normals to 6e-5
# radians; at its ends they are exact
_ARC = np.radians(7.5)
# Corners that turn by less than this are straight; radians
_STRAIGHT = 1e-9
# Share of an edge's length by which fillets may overlap: rounding
_FIT = 1e-12


class Polyline(Surface):
    """Tool of 2D problems: straight lines, with fillets in their corners.

    Two points make a segment. Lines and fillets meet without a kink. The result is a
    `Surface`: facets of degree 2 where there are fillets, else of degree 1.

    Parameters
    ----------
    points
        Corners one after the other, (n, 2). Length.
    radius
        Radius of the fillets: a number for all corners; or one for each corner, 0 for a
        sharp one: n - 2 of them, n of a closed polyline. Length.
    inside
        A point in the solid, near the lines. None: the solid is on the left as you walk
        along the points; a closed polyline encloses it.
    closed
        Whether a line joins the last point to the first. Otherwise the polyline is a face
        of a solid behind it.

    Examples
    --------
    >>> corners = [(0.2, 2.0), (0.2, 1.0), (0.8, 1.0), (0.8, 2.0)]
    >>> punch = rigid.Polyline(corners, radius=0.1, inside=(0.5, 1.5))
    >>> stop = rigid.Polyline([(1.0, 0.0), (1.0, 2.0)], inside=(1.1, 1.0))
    """

    def __init__(
        self,
        points: Any,
        radius: float | Sequence[float] = 0.0,
        inside: Vector | None = None,
        closed: bool = False,
    ) -> None:
        x = checked_points(points)
        closed = truth("closed", closed)
        least = 3 if closed else 2
        if x.shape[1] != 2 or len(x) < least:
            raise ContactError(
                f"points of a polyline must be {least} or more in 2D, not an array "
                f"{x.shape}"
            )
        nodes, facets = _rounded(x, _radii(radius, len(x), closed), closed)
        at = _crossing(nodes[facets[:, 0]], nodes[facets[:, 1]], closed)
        if at is not None:
            raise ContactError(
                f"a polyline crosses itself at {format_point(at, x)}: its points "
                "must go along the tool's face one after the other, and fillets must not "
                "reach another line"
            )
        orient = closed and inside is None
        super().__init__(nodes, facets, orient, closed, inside=inside)


def _radii(radius: Any, count: int, closed: bool) -> Array:
    """Radius at each point, (count,); 0 at the ends of an open polyline."""
    corners = count if closed else count - 2
    try:
        given = np.asarray(radius, dtype=float)
        found = np.broadcast_to(given, corners) if given.ndim == 0 else given
    except (TypeError, ValueError):
        found = np.full(1, np.nan)
    if found.shape != (corners,) or not (np.isfinite(found) & (found >= 0.0)).all():
        raise ContactError(
            f"radius = {radius!r} must be a number, 0 or more, or one for each of "
            f"{corners} corners"
        )
    return found if closed else np.pad(found, 1)


def _rounded(x: Array, radii: Array, closed: bool) -> tuple[Array, Any]:
    """Nodes and facets of lines through points (n, 2) with fillets."""
    n = len(x)
    ways = np.roll(x, -1, axis=0) - x
    lengths = np.linalg.norm(ways, axis=1)
    edges = n if closed else n - 1
    if not lengths[:edges].all():
        k = int(np.argmin(lengths[:edges]))
        raise ContactError(f"points {k} and {(k + 1) % n} of a polyline are the same")
    ways /= np.maximum(lengths, np.finfo(float).tiny)[:, None]
    before = np.roll(ways, 1, axis=0)
    turns = np.arctan2(_cross(before, ways), np.einsum("ni,ni->n", before, ways))
    round_ = (radii > 0.0) & (np.abs(turns) > _STRAIGHT)
    cut = np.where(round_, radii * np.tan(0.5 * np.abs(turns)), 0.0)
    room = (lengths - cut - np.roll(cut, -1))[:edges]
    if room.min() < -_FIT * lengths.max():
        k = int(np.argmin(room))
        k = k if cut[k] > 0.0 else (k + 1) % n
        raise ContactError(
            f"radius = {radii[k]:.6g} does not fit into corner {k} of a polyline, at "
            f"{format_point(x[k], x)}: its lines are too short"
        )
    chains = [
        _fillet(x[k] - cut[k] * before[k], before[k], radii[k], turns[k])
        if round_[k]
        else x[k : k + 1]
        for k in range(n)
    ]
    return _joined_chains(chains, closed, bool(round_.any()))


def _crossing(starts: Array, ends: Array, closed: bool) -> Array | None:
    """First place, (2,), where a chain of lines from starts to ends, (n, 2) each, crosses
    itself; None without any."""
    for k, (start, end) in enumerate(zip(starts[:-2], ends[:-2])):
        # Neighbours meet; so do the last line and the first of a closed chain
        others = slice(k + 2, -1 if closed and k == 0 else None)
        a, b, way = starts[others] - start, ends[others] - start, end - start
        sides = [_cross(way, a), _cross(way, b)]
        of_start, of_end = _cross(b - a, -a), _cross(b - a, way - a)
        is_crossed = (sides[0] * sides[1] < 0.0) & (of_start * of_end < 0.0)
        if is_crossed.any():
            i = int(np.argmax(is_crossed))
            share = of_start[i] / (of_start[i] - of_end[i])
            found: Array = start + share * way
            return found
    return None


def _cross(a: Array, b: Array) -> Array:
    """Third component of the cross product of vectors in the plane, (n,)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _fillet(start: Array, way: Array, radius: float, turn: float) -> Array:
    """Ends and middles of the facets of an arc in turn, (2 m + 1, 2).

    A middle is where the parabola is that touches the arc at both ends.
    """
    count = max(1, int(np.ceil(np.abs(turn) / _ARC - 1e-9)))
    half = 0.5 * turn / count
    left = np.array([-way[1], way[0]]) * np.sign(turn)
    centre = start + radius * left
    angles = half * np.arange(2 * count + 1)
    out = np.full(len(angles), radius)
    out[1::2] *= 0.5 * (np.cos(half) + 1.0 / np.cos(half))
    c, s = np.cos(angles), np.sin(angles)
    # The radius to the start, turned along
    x, y = -left
    return centre + out[:, None] * np.column_stack([c * x - s * y, s * x + c * y])


def _joined_chains(
    chains: Sequence[Array], closed: bool, bent: bool
) -> tuple[Array, Any]:
    """Nodes and facets of chains of facets, one at each point, and of lines between.

    Facets are intervals of degree 2 if any is bent. A line without length is left out.
    """
    nodes, facets, count = list(chains), [], 0
    size = np.ptp(np.vstack(chains), axis=0).max()
    begins = np.cumsum([0, *map(len, chains)])
    count = int(begins[-1])
    for k, chain in enumerate(chains):
        first, last = int(begins[k]), int(begins[k + 1]) - 1
        facets += [(i, i + 2, i + 1) for i in range(first, last, 2)]
        if k + 1 == len(chains) and not closed:
            break
        other = (k + 1) % len(chains)
        ends = chain[-1], chains[other][0]
        if np.linalg.norm(ends[1] - ends[0]) > 1e-9 * size:
            facets.append((last, int(begins[other]), count))
            nodes.append(0.5 * (ends[0] + ends[1])[None])
            count += 1
    return np.vstack(nodes), np.array(facets)[:, : 3 if bent else 2]
