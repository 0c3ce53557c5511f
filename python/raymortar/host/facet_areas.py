"""Areas of facets, undeformed."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import compat
from ..compat import Array
from .reference_facets import normals, shape_functions


def rule_normals(shape: str, degree: int, nodes: Array) -> tuple[Array, Array, Array]:
    """A rule on facets, and their normals m there, whose length is the Jacobian.

    Parameters
    ----------
    shape, degree
        Of the facets.
    nodes
        Positions, (facets, nodes per facet, d). Length.

    Returns
    -------
    points, weights, m
        Shapes (n, d - 1), (n,) and (facets, n, d).
    """
    points, weights = compat.quadrature(shape, 2 * degree)
    _, gradients = shape_functions(shape, degree, points)
    return points, weights, normals(np.einsum("iqa,fad->ifqd", gradients, nodes))


def facet_areas(shape: str, degree: int, nodes: Array) -> Array:
    """Area (length in 2D) of facets given by their nodes, (facets,)."""
    _, weights, m = rule_normals(shape, degree, nodes)
    return np.linalg.norm(m, axis=-1) @ weights


def surface_normals(surface: Any) -> tuple[Array, Array, Array]:
    """`rule_normals` of the facets of a `Surface`, undeformed."""
    nodes = surface.X[surface.facet_nodes]
    return rule_normals(surface.shape, surface.node_degree, nodes)


def surface_areas(surface: Any) -> Array:
    """Area (length in 2D) of the facets of a `Surface`, undeformed, (facets,)."""
    _, weights, m = surface_normals(surface)
    return np.linalg.norm(m, axis=-1) @ weights
