"""Areas of undeformed facets, or of the surfaces that they make in a full turn."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import compat
from ..compat import Array
from .axisymmetry import circumference
from .reference_facets import normals, shape_functions


def rule_normals(
    shape: str, degree: int, nodes: Array, axisymmetric: bool = False
) -> tuple[Array, Array, Array]:
    """A quadrature rule, and at its points the facets' normals m, whose length is the
    Jacobian.

    Parameters
    ----------
    shape, degree
        Of the facets.
    nodes
        Positions, (facets, nodes per facet, d). Length.
    axisymmetric
        Whether areas are those of a full turn: m is then longer by the circumference.

    Returns
    -------
    points, weights, m
        Shapes (n, d - 1), (n,) and (facets, n, d).
    """
    points, weights = compat.quadrature(shape, 2 * degree + axisymmetric)
    N, gradients = shape_functions(shape, degree, points)
    m = normals(np.einsum("iqa,fad->ifqd", gradients, nodes))
    if axisymmetric:
        m = m * circumference(np.einsum("qa,fad->fqd", N, nodes))[..., None]
    return points, weights, m


def facet_areas(shape: str, degree: int, nodes: Array) -> Array:
    """Area (length in 2D) of facets given by their nodes, (facets,)."""
    _, weights, m = rule_normals(shape, degree, nodes)
    return np.linalg.norm(m, axis=-1) @ weights


def surface_normals(surface: Any) -> tuple[Array, Array, Array]:
    """`rule_normals` of the undeformed facets of a `Surface`."""
    nodes = surface.X[surface.facet_nodes]
    return rule_normals(surface.shape, surface.node_degree, nodes, surface.axisymmetric)


def surface_areas(surface: Any) -> Array:
    """Area of the undeformed facets of a `Surface`, (facets,): in 2D a length, or the
    area of a full turn if it is axisymmetric."""
    _, weights, m = surface_normals(surface)
    return np.linalg.norm(m, axis=-1) @ weights


def surface_sizes(surface: Any) -> Array:
    """Area of the facets themselves, in 2D their length, (facets,)."""
    nodes = surface.X[surface.facet_nodes]
    return facet_areas(surface.shape, surface.node_degree, nodes)
