"""Reference facets: shape functions, and which nodes of a cell are on a facet.

Facets have their nodes in the order of the Basix element on the reference facet, turned
such that the normal points out of the cell: with the tangents t_i = dx/dxi_i,
m = t_1 x t_2 in 3D and m = (t_y, -t_x) in 2D.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from .. import compat
from ..compat import Array, Indices

FACET_SHAPE = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}

# Nodes of the degree-2 reference facets; the first ones are those of degree 1. The
# C++ library relies on this order.
FACET_NODES = {
    "interval": np.array([[0], [1], [0.5]]),
    "triangle": np.array([[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.5], [0.5, 0]]),
    "quadrilateral": np.array(
        [[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 0], [0, 0.5], [1, 0.5], [0.5, 1]]
        + [[0.5, 0.5]]
    ),
}
N_CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}

# Reference coordinates are O(1); nodes are at least 1/2 apart.
MATCH_TOLERANCE = 1e-10


def facet_nodes(shape: str, degree: int) -> Array:
    """Nodes of a reference facet of degree 1 or 2, shape (n, d - 1)."""
    nodes = FACET_NODES[shape]
    return nodes if degree == 2 else nodes[: N_CORNERS[shape]]


def _monomials(shape: str, degree: int) -> list[tuple[int, ...]]:
    """Exponents of the monomials that span the facet's polynomials."""
    if shape == "interval":
        return [(i,) for i in range(degree + 1)]
    pairs = [(i, j) for i in range(degree + 1) for j in range(degree + 1)]
    return [p for p in pairs if shape == "quadrilateral" or sum(p) <= degree]


def _evaluate(exponents: Sequence[tuple[int, ...]], points: Array) -> Array:
    """Monomials at points, shape (n_points, n_monomials)."""
    return np.prod(points[:, None, :] ** np.array(exponents)[None], axis=2)


def _differentiate(
    exponents: Sequence[tuple[int, ...]], points: Array, axis: int
) -> Array:
    """First derivatives of monomials at points, shape (n_points, n_monomials)."""
    powers = np.array(exponents)
    factors = powers[:, axis].copy()
    powers[:, axis] = np.maximum(powers[:, axis] - 1, 0)
    return factors * np.prod(points[:, None, :] ** powers[None], axis=2)


@functools.lru_cache(maxsize=None)
def _coefficients(shape: str, degree: int) -> Array:
    """Of the monomials in each shape function, (n_monomials, n)."""
    exponents = _monomials(shape, degree)
    return np.linalg.inv(_evaluate(exponents, facet_nodes(shape, degree)))


def shape_functions(shape: str, degree: int, points: Array) -> tuple[Array, Array]:
    """Lagrange functions on a reference facet, in raymortar's node order.

    Parameters
    ----------
    shape, degree
        Facet shape, and degree 1 or 2.
    points
        Reference points, shape (n_points, d - 1).

    Returns
    -------
    values, gradients
        Shapes (n_points, n) and (d - 1, n_points, n).
    """
    exponents = _monomials(shape, degree)
    coefficients = _coefficients(shape, degree)
    derivatives = [
        _differentiate(exponents, points, axis) for axis in range(points.shape[1])
    ]
    return _evaluate(exponents, points) @ coefficients, derivatives @ coefficients


def normals(tangents: Array) -> Array:
    """Un-normalised normals m of facets.

    Parameters
    ----------
    tangents
        dx/dxi_i, shape (d - 1, ..., d).

    Returns
    -------
    ndarray
        m, shape (..., d); its length is the surface Jacobian.
    """
    if len(tangents) == 2:
        return np.cross(tangents[0], tangents[1])
    return np.stack([tangents[0, ..., 1], -tangents[0, ..., 0]], axis=-1)


def middle_normals(shape: str, degree: int, nodes: Array) -> Array:
    """Un-normalised normals m in the middle of facets, (n_facets, d).

    Parameters
    ----------
    shape, degree
        Of the facets.
    nodes
        Their positions, shape (n_facets, n, d).
    """
    middle = facet_nodes(shape, 1).mean(axis=0, keepdims=True)
    _, gradients = shape_functions(shape, degree, middle)
    return normals(np.einsum("ia,fad->ifd", gradients[:, 0], nodes))


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

    Parameters
    ----------
    cell, degree
        Cell type, and degree 1 or 2 of the element.

    Returns
    -------
    ndarray
        Shape (n_local_facets, n), indices into the nodes of the cell's element.
    """
    shape = FACET_SHAPE[cell]
    element = compat.basix_element(cell, degree)
    values, _ = shape_functions(shape, 1, facet_nodes(shape, degree))
    rows = []
    for vertices in element.facet_vertices:
        rows.append(
            match_points(element.points, values @ element.vertices[list(vertices)])
        )
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
