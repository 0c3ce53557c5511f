"""Surfaces of facets that are not part of a DOLFINx mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .. import _cpp
from ..arguments import vector
from ..core.compat import Array, Indices
from ..core.errors import ContactError, format_point, truth
from .shapes import Shape, Vector

# Facets by dimension and number of nodes: shape, degree, and the places of Gmsh's, VTK's
# and meshio's nodes in the order of the library
_KINDS = {
    (2, 2): ("interval", 1, (0, 1)),
    (2, 3): ("interval", 2, (0, 1, 2)),
    (3, 3): ("triangle", 1, (0, 1, 2)),
    (3, 4): ("quadrilateral", 1, (0, 1, 3, 2)),
    (3, 6): ("triangle", 2, (0, 1, 2, 4, 5, 3)),
    (3, 9): ("quadrilateral", 2, (0, 1, 3, 2, 4, 7, 5, 6, 8)),
}
# Order of the points of a facet that is turned over
_TURNED = {
    "interval": (1, 0, 2),
    "triangle": (0, 2, 1, 5, 4, 3),
    "quadrilateral": (0, 3, 2, 1, 7, 6, 5, 4, 8),
}
_CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}

# Points closer than this share of the surface's size are merged. Facets that are no wider
# have no normal
_SAME = 1e-10
# A point from which an open surface hides less of all directions is on neither side
_LEVEL = 1e-6


@dataclass(frozen=True, repr=False, eq=False)
class Surface(Shape):
    """Solid behind facets: intervals in 2D, triangles or quadrilaterals in 3D.

    Every rank has all facets, about 300 bytes each.

    Parameters
    ----------
    points
        (n, 2) or (n, 3). Length. Points at the same place are merged, as
        STL files repeat them.
    facets
        Points of each facet, (m, k), in the order of Gmsh, VTK and meshio: 2 or 3 in
        2D; 3 or 6 of triangles, 4, 8 or 9 of quadrilaterals. Normals point out of the
        solid: counter-clockwise seen from outside, in 2D the solid on the left.
    orient
        Whether to turn facets such that their orientations agree, and normals of a
        closed surface point outward. Without it, such facets are an error.
    closed
        Whether the surface must be closed. If False, an open surface is a face of a
        solid behind it.
    hollow
        Whether the solid is around the surface: a die whose cavity is given.
    inside
        A point in the solid, near the surface, in place of `orient` and `hollow`: facets
        are turned such that it is behind them. Of a closed surface it may be on either
        side. The surface must be in one piece.
    """

    has_inside: ClassVar[bool] = False
    points: Array
    facets: Any
    orient: bool = False
    closed: bool = True
    hollow: bool = False
    inside: Vector | None = None

    def __post_init__(self) -> None:
        for name in ("orient", "closed", "hollow"):
            truth(name, getattr(self, name))
        points = checked_points(self.points)
        facets = _checked_facets(self.facets, points)
        points, facets = _joined(points, facets)
        if facets.shape[1] == 8:  # a ninth node is in the centre
            x = points[facets]
            centres = 0.5 * x[:, 4:].sum(axis=1) - 0.25 * x[:, :4].sum(axis=1)
            numbers = len(points) + np.arange(len(facets))
            points, facets = np.vstack([points, centres]), np.c_[facets, numbers]
        shape, _, _ = _KINDS[points.shape[1], facets.shape[1]]
        facets = _with_area(points, facets, shape)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "facets", self._oriented(points, facets, shape))

    def _oriented(self, points: Array, facets: Indices, shape: str) -> Indices:
        """The facets with normals out of the solid, or an error."""
        corners = _CORNERS[shape]
        if self.orient or self.inside is not None:
            turn = _turns(facets[:, :corners])
            facets = np.where(turn[:, None], _turned(facets, shape), facets)
        rim, wrong = _edge_faults(facets[:, :corners])
        if len(wrong):
            raise ContactError(
                f"normals of facets disagree at {len(wrong)} edges of the surface, for "
                f"example next to {_at(points, wrong[0])}: orient=True turns them"
            )
        if len(rim) and self.closed:
            raise ContactError(
                f"the surface is open: {len(rim)} edges have one facet only, for "
                f"example next to {_at(points, rim[0])}. closed=False takes it for the "
                "face of a solid behind it"
            )
        if self.inside is not None:
            if self._is_in_front(points, facets[:, :corners], len(rim) > 0):
                return _turned(facets, shape)
            return facets
        if len(rim) == 0 and _volume(points, facets[:, :corners]) < 0.0:
            if not self.orient:
                raise ContactError(
                    "the surface is inside out: its normals point into what it encloses. "
                    "orient=True turns it, and hollow=True makes the solid what is "
                    "around it"
                )
            facets = _turned(facets, shape)
        return _turned(facets, shape) if self.hollow else facets

    def _is_in_front(self, points: Array, corners: Indices, is_open: bool) -> bool:
        """Whether the point `inside` is where normals point to, or an error."""
        gdim = points.shape[1]
        x = vector("inside", self.inside, gdim)[:gdim]
        if self.hollow:
            raise ContactError("hollow=True and inside= are one too many: give inside=")
        number, _ = edges_of(corners)
        of = np.repeat(np.arange(len(corners)), corners.shape[1]), number.ravel()
        joins = coo_array((np.ones(corners.size), of))
        pieces, _ = connected_components(joins @ joins.T, directed=False)
        if pieces > 1:
            raise ContactError(
                f"inside= tells the side of a surface in one piece: this one has {pieces}"
            )
        around = winding(points, corners, x)
        if not is_open:
            encloses = abs(around) > 0.5
            return around < 0.0 if encloses else _volume(points, corners) > 0.0
        if abs(around) < _LEVEL:
            raise ContactError(
                f"inside = {self.inside!r} is level with the surface: give a point nearer "
                "to it, in the solid"
            )
        return around < 0.0

    def __repr__(self) -> str:
        # Alike on all ranks that have the same arrays
        size = np.abs(self.points).sum()
        return f"{type(self).__name__}({len(self.facets)} facets, {size:.17g})"

    @property
    def gdim(self) -> int:
        return int(self.points.shape[1])

    @property
    def place(self) -> Array:
        middle = 0.5 * (self.points.min(axis=0) + self.points.max(axis=0))
        return np.pad(middle, (0, 3 - len(middle)))

    def cpp(self) -> _cpp.Tool:
        shape, degree, order = _KINDS[self.gdim, self.facets.shape[1]]
        nodes = np.ascontiguousarray(self.facets[:, list(order)], dtype=np.int32)
        return _cpp.facet_tool(getattr(_cpp.Shape, shape), degree, self.points, nodes)


def checked_points(given: Any) -> Array:
    """Check points (n, 2) or (n, 3)."""
    try:
        points = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise ContactError("points must be an array (n, 2) or (n, 3)")
    if not np.isfinite(points).all():
        raise ContactError("points has values that are not finite")
    return points


def _checked_facets(given: Any, points: Array) -> Indices:
    facets = np.asarray(given)
    dim = points.shape[1]
    widths = (2, 3) if dim == 2 else (3, 4, 6, 8, 9)
    whole = np.issubdtype(facets.dtype, np.integer)
    if facets.ndim != 2 or not whole or facets.shape[1] not in widths:
        raise ContactError(
            f"facets must be whole numbers (m, k) with k one of {widths} in {dim}D, not "
            f"an array {facets.shape} of {facets.dtype}"
        )
    if not len(facets):
        raise ContactError("facets is empty")
    if facets.min() < 0 or facets.max() >= len(points):
        raise ContactError(
            f"facets has point {facets.min() if facets.min() < 0 else facets.max()}: "
            f"there are those from 0 to {len(points) - 1}"
        )
    return facets.astype(np.int64)


def _joined(points: Array, facets: Any) -> tuple[Array, Any]:
    """Points in use, with points at the same place merged."""
    size = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    used = np.unique(facets)
    keys = np.round((points[used] - points.min(axis=0)) / (_SAME * size))
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    at = np.empty(len(points), dtype=np.int64)
    at[used] = number.reshape(-1)
    return points[used[first]], at[facets]


def _with_area(points: Array, facets: Indices, shape: str) -> Indices:
    """Facets without those of no area, which STL files may have."""
    x = points[facets[:, : _CORNERS[shape]]]
    longest = np.linalg.norm(np.ptp(x, axis=1), axis=1)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if shape == "interval":
        measure, least, lacking = longest, _SAME * size, "length"
    else:
        across = np.cross(x[:, 1] - x[:, 0], x[:, -1] - x[:, 0])
        if shape == "quadrilateral":
            across = across + np.cross(x[:, 3] - x[:, 2], x[:, 1] - x[:, 2])
        measure, least = np.linalg.norm(across, axis=1), _SAME * size * longest
        lacking = "area"
    kept = facets[measure > least]
    if not len(kept):
        raise ContactError(
            f"no facet has any {lacking}: the first of {len(facets)}, facet 0, is at "
            f"{format_point(x[0].mean(axis=0), points)}"
        )
    return kept


def _turned(facets: Indices, shape: str) -> Indices:
    order = [k for k in _TURNED[shape] if k < facets.shape[1]]
    return facets[:, order]


def edges_of(corners: Indices) -> tuple[Indices, Indices]:
    """Numbers of each facet's edges (of its points in 2D), (m, k), and 1 if the facet
    runs along the edge from the smaller to the larger point, else -1."""
    if corners.shape[1] == 2:
        return corners, np.broadcast_to(np.array([-1, 1]), corners.shape)
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1)
    ways = np.where(ends[..., 0] < ends[..., 1], 1, -1)
    keys = np.sort(ends, axis=-1).reshape(-1, 2)
    _, number = np.unique(keys, axis=0, return_inverse=True)
    return number.reshape(corners.shape), ways


def _edge_faults(corners: Indices) -> tuple[Indices, Indices]:
    """A point of each edge with a single facet, and of each edge whose facets have
    opposite orientations."""
    number, ways = edges_of(corners)
    _, first, edge, count = np.unique(
        number, return_index=True, return_inverse=True, return_counts=True
    )
    balance = np.bincount(edge.ravel(), ways.ravel())
    point = corners.ravel()[first]
    return point[count == 1], point[(count > 1) & (balance != 0.0)]


def _turns(corners: Indices) -> Any:
    """Whether to turn each facet, (m,), so that connected facets have the orientation
    of the first of them."""
    number, ways = edges_of(corners)
    m, k = corners.shape
    order = np.argsort(number.ravel(), kind="stable")
    edge, facet, way = number.ravel()[order], order // k, ways.ravel()[order]
    same = np.flatnonzero(edge[1:] == edge[:-1])
    one, other = facet[same], facet[same + 1]
    differ = m * (way[same] == way[same + 1])  # neighbours run along an edge both ways
    # Each facet as it is, and m places on as it is when turned
    ends = np.r_[one, one + m], np.r_[other + differ, other + m - differ]
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(2 * m, 2 * m))
    _, part = connected_components(graph, directed=False)
    pair = np.minimum(part[:m], part[m:])
    _, first, of_pair = np.unique(pair, return_index=True, return_inverse=True)
    return part[:m] != part[first][of_pair]


def _volume(points: Array, corners: Indices) -> float:
    """Enclosed volume, by straight facets; negative if normals point into it."""
    x = points[corners] - points[corners].reshape(-1, points.shape[1]).mean(axis=0)
    if corners.shape[1] == 2:
        return float(np.linalg.det(x).sum())
    fans = [x[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
    return float(np.linalg.det(fans).sum())


def _at(points: Array, number: Any) -> str:
    return format_point(points[number], points)


def winding(points: Array, corners: Indices, x: Array) -> float:
    """Share of all directions from a point in which facets hide their inner side.

    Facets (m, k) are taken straight. 1 in a closed surface whose normals point outward, 0
    out of it. Of an open surface positive behind it, negative in front of it.
    """
    to = points[corners] - x
    if corners.shape[1] == 2:
        a, b = to[:, 0], to[:, 1]
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        angles = np.arctan2(cross, np.einsum("ni,ni->n", a, b))
        return float(angles.sum() / (2.0 * np.pi))
    fans = [to[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
    triangles = np.concatenate(fans)
    # Van Oosterom and Strackee: tan(angle / 2) = det [a b c] / (|a| |b| |c| + ...)
    a, b, c = np.moveaxis(triangles, 1, 0)
    la, lb, lc = np.linalg.norm(triangles, axis=2).T
    ab, bc, ca = (np.einsum("ni,ni->n", s, t) for s, t in ((a, b), (b, c), (c, a)))
    below = la * lb * lc + ab * lc + bc * la + ca * lb
    angles = 2.0 * np.arctan2(np.linalg.det(triangles), below)
    return float(angles.sum() / (4.0 * np.pi))
