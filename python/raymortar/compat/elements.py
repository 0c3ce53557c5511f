"""Lagrange elements of reference cells, and quadrature rules on them."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np

from .generation import Array


@dataclass(frozen=True)
class ReferenceElement:
    """Lagrange element on a reference cell, as arrays.

    Attributes
    ----------
    points
        Node of each dof, shape (n_dofs, tdim), reference coordinates.
    facet_dofs
        Dofs in the closure of each local facet.
    facet_vertices
        Cell vertices of each local facet, in Basix order.
    vertices
        Vertices of the reference cell, shape (n_vertices, tdim).
    gradients
        Derivatives of the functions at the points, shape (tdim, n_dofs, n_dofs): by
        direction, point, function.
    """

    points: Array
    facet_dofs: tuple[tuple[int, ...], ...]
    facet_vertices: tuple[tuple[int, ...], ...]
    vertices: Array
    gradients: Array


@functools.lru_cache(maxsize=None)
def _lagrange(cell: str, degree: int) -> Any:
    """Make the Lagrange element of Basix, equispaced."""
    cell_type, variant = getattr(basix.CellType, cell), basix.LagrangeVariant.equispaced
    return basix.create_element(basix.ElementFamily.P, cell_type, degree, variant)


@functools.lru_cache(maxsize=None)
def basix_element(cell: str, degree: int) -> ReferenceElement:
    """Plain Lagrange element of Basix.

    Parameters
    ----------
    cell
        Name of the cell, such as ``"triangle"``.
    degree
        Polynomial degree, 1 or more.
    """
    element, cell_type = _lagrange(cell, degree), getattr(basix.CellType, cell)
    topology = basix.topology(cell_type)
    facet_dim = len(topology) - 2
    return ReferenceElement(
        points=np.array(element.points),
        facet_dofs=tuple(map(tuple, element.entity_closure_dofs[facet_dim])),
        facet_vertices=tuple(map(tuple, topology[facet_dim])),
        vertices=np.array(basix.geometry(cell_type)),
        gradients=tabulate(cell, degree, element.points)[1:],
    )


def tabulate(cell: str, degree: int, points: Array) -> Array:
    """Shape functions of that element and their gradients, as Basix has them.

    Returns
    -------
    ndarray
        Shape (1 + tdim, n_points, n): values, then derivatives along each axis.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    element = _lagrange(cell, degree)
    if not len(points):  # which some versions of Basix do not survive
        return np.zeros((1 + points.shape[1], 0, element.dim))
    return np.array(element.tabulate(1, points)[:, :, :, 0])


@functools.lru_cache(maxsize=None)
def quadrature(shape_name: str, degree: int) -> tuple[Array, Array]:
    """Quadrature rule on a Basix reference cell.

    Parameters
    ----------
    shape_name
        ``"interval"``, ``"triangle"`` or ``"quadrilateral"``.
    degree
        Degree up to which polynomials are integrated exactly.

    Returns
    -------
    points, weights
        Shapes (n, tdim) and (n,); the weights sum to the cell's reference volume.
        Shared between callers, hence read-only.
    """
    rule = basix.make_quadrature(getattr(basix.CellType, shape_name), degree)
    points, weights = (np.array(part, dtype=np.float64) for part in rule)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights
