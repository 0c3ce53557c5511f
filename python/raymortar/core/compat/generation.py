"""Types, versions, vectors, Lagrange elements and options of PETSc that all of compat uses."""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import basix
import dolfinx
import numpy as np
import numpy.typing as npt
import ufl

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int32]
Mask = npt.NDArray[np.bool_]

# UFL lost its own element classes when Basix took them over (DOLFINx 0.8).
HAS_UFL_ELEMENTS = hasattr(ufl, "VectorElement")


def unwrap(wrapped: Any) -> Any:
    """C++ object behind a Python one; the object itself where it is the C++ one."""
    return getattr(wrapped, "_cpp_object", wrapped)


def table(adjacency: Any, width: int) -> Indices:
    """Rows of equal length as an array (n, width); 0.5 has adjacency lists."""
    return np.asarray(getattr(adjacency, "array", adjacency)).reshape(-1, width)


def scalar_type_is_real() -> bool:
    """Whether PETSc was built for real numbers."""
    return not np.issubdtype(PETSc.ScalarType, np.complexfloating)


def create_la_vector(index_map: Any, bs: int = 1) -> Any:
    """Zero ``dolfinx.la`` vector of doubles over an index map with a block size."""
    if hasattr(index_map, "create_vector"):  # of several meshes
        return index_map.create_vector(bs)
    return dolfinx.la.vector(index_map, bs, dtype=np.float64)


def scatter_forward(vector: Any) -> None:
    """Send the owners' values to the ghosts. Collective."""
    vector.scatter_forward()


def scatter_reverse_add(vector: Any) -> None:
    """Add the ghosts' values to their owners'. Collective.

    Ghosts keep theirs: follow with :func:`scatter_forward` where they are read.
    """
    modes = getattr(dolfinx.la, "InsertMode", None) or dolfinx.la.ScatterMode
    vector.scatter_reverse(modes.add)


# Lagrange elements of reference cells, and quadrature rules on them


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
    """Plain Lagrange element of Basix on a cell such as ``"triangle"``."""
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
    """Values and derivatives of that element's functions, (1 + tdim, n_points, n)."""
    points = np.ascontiguousarray(points, dtype=np.float64)
    element = _lagrange(cell, degree)
    if not len(points):  # which some versions of Basix do not survive
        return np.zeros((1 + points.shape[1], 0, element.dim))
    return np.array(element.tabulate(1, points)[:, :, :, 0])


@functools.lru_cache(maxsize=None)
def quadrature(shape_name: str, degree: int) -> tuple[Array, Array]:
    """Quadrature rule on a reference cell: points (n, tdim) and weights (n,).

    Shared between callers, hence read-only.
    """
    rule = basix.make_quadrature(getattr(basix.CellType, shape_name), degree)
    points, weights = (np.array(part, dtype=np.float64) for part in rule)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


def option_was_read(name: str) -> bool:
    """Whether anything has read an option that is in PETSc's table now.

    Parameters
    ----------
    name
        With its prefix and without a dash.
    """
    # The module's own symbols include those of the libraries that it is linked with.
    # PETSc writes an int or a byte, by its version
    used = ctypes.c_int(0)
    ctypes.CDLL(PETSc.__file__).PetscOptionsUsed(
        None, name.encode(), ctypes.byref(used)
    )
    return used.value != 0
