"""Reference facets: shape functions, and the nodes of a cell that are on a facet.

Facets have their nodes in the order of the Basix element on the reference facet, turned
such that the normal points out of the cell: with the tangents t_i = dx/dxi_i,
m = t_1 x t_2 in 3D and m = (t_y, -t_x) in 2D.
"""

from __future__ import annotations

import functools

import numpy as np

from .. import compat
from ..compat import Array, Indices

FACET_SHAPE = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}

N_CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}

# Reference coordinates are O(1); nodes are at least 1/2 apart.
MATCH_TOLERANCE = 1e-10


def facet_nodes(shape: str, degree: int) -> Array:
    """Nodes of a reference facet of degree 1 or 2, shape (n, d - 1).

    The first ones are those of degree 1. The C++ library relies on this order.
    """
    return compat.basix_element(shape, degree).points


def shape_functions(shape: str, degree: int, points: Array) -> tuple[Array, Array]:
    """Evaluate the Lagrange functions on a reference facet at points (n_points, d - 1).

    Values have the shape (n_points, n), gradients (d - 1, n_points, n).
    """
    table = compat.tabulate(shape, degree, points)
    return table[0], table[1:]


def interpolate(shape: str, degree: int, nodal: Array, points: Array) -> Array:
    """Values at one point (n, d - 1) of each facet, by nodal values (n, nodes, ...)."""
    return np.einsum("qa,qa...->q...", shape_functions(shape, degree, points)[0], nodal)


def normals(tangents: Array) -> Array:
    """Normals m (..., d) of facets, by their tangents dx/dxi_i (d - 1, ..., d).

    Their length is the surface Jacobian.
    """
    if len(tangents) == 2:
        return np.cross(tangents[0], tangents[1])
    return np.stack([tangents[0, ..., 1], -tangents[0, ..., 0]], axis=-1)


def middle_normals(shape: str, degree: int, nodes: Array) -> Array:
    """Normals m (..., d) in the middle of facets with nodes (..., n, d)."""
    middle = facet_nodes(shape, 1).mean(axis=0, keepdims=True)
    _, gradients = shape_functions(shape, degree, middle)
    return normals(np.einsum("ia,...ad->i...d", gradients[:, 0], nodes))


def units(vectors: Array) -> Array:
    """Scale vectors (..., d) to length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a: Array, b: Array) -> Array:
    """Products of vectors (..., d), (...)."""
    return np.einsum("...d,...d->...", a, b)


def match_points(points: Array, targets: Array) -> list[int]:
    """Index among points of each target."""
    distances = np.linalg.norm(points[None] - targets[:, None], axis=2)
    matches = distances.argmin(axis=1)
    if np.any(distances[np.arange(len(targets)), matches] > MATCH_TOLERANCE):
        raise RuntimeError("a node of a facet is not a node of its cell")
    return matches.tolist()


@functools.lru_cache(maxsize=None)
def cell_facet_nodes(cell: str, degree: int) -> Indices:
    """Cell nodes of each local facet, in raymortar's order, not yet turned outward.

    Found by position, so that no numbering convention of a version is relied on.
    Indices into the nodes of the cell's element, (n_local_facets, n).
    """
    shape = FACET_SHAPE[cell]
    element = compat.basix_element(cell, degree)
    values, _ = shape_functions(shape, 1, facet_nodes(shape, degree))
    rows = [
        match_points(element.points, values @ element.vertices[list(vertices)])
        for vertices in element.facet_vertices
    ]
    return np.array(rows, dtype=np.int32)


@functools.lru_cache(maxsize=None)
def reflection(shape: str, degree: int) -> Indices:
    """Permutation of a facet's nodes that reverses its normal, shape (n,).

    The ends of an interval change places, as do xi and eta of a triangle or
    quadrilateral.
    """
    nodes = facet_nodes(shape, degree)
    mirrored = 1 - nodes if shape == "interval" else nodes[:, ::-1]
    return np.array(match_points(nodes, mirrored), dtype=np.int32)
