"""Fields at quadrature points, values of UFL expressions there, and values by cell."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import dolfinx.mesh
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from .generation import HAS_UFL_ELEMENTS, Array, quadrature
from .meshes import _with_shape, cell_name, dofmap_array


def quadrature_space(
    mesh: dolfinx.mesh.Mesh, degree: int, shape: Sequence[int] = ()
) -> fem.FunctionSpace:
    """Space of values at the quadrature points of cells.

    Forms take its Functions where their measure has ``metadata={"quadrature_degree":
    degree, "quadrature_scheme": "default"}``.

    Parameters
    ----------
    mesh
        Mesh.
    degree
        Degree of the polynomials that the rule integrates exactly.
    shape
        Shape of the values: (), (n,) or (m, n).
    """
    shape = tuple(shape)
    if HAS_UFL_ELEMENTS:
        element: Any = ufl.FiniteElement(
            "Quadrature", mesh.ufl_cell(), degree, quad_scheme="default"
        )
        return fem.FunctionSpace(mesh, _with_shape(element, shape))
    import basix.ufl

    element = basix.ufl.quadrature_element(
        cell_name(mesh), value_shape=shape, scheme="default", degree=degree
    )
    return fem.functionspace(mesh, element)


class AtQuadraturePoints:
    """Values of a UFL expression at the quadrature points of this rank's cells.

    Parameters
    ----------
    expression
        UFL expression without test or trial function.
    mesh, degree
        Mesh and degree of the rule, as of `quadrature_space`.

    Examples
    --------
    >>> strain = AtQuadraturePoints(ufl.sym(ufl.grad(u)), mesh, degree=2)
    >>> values = strain()  # (cells, points, d * d)
    """

    def __init__(self, expression: Any, mesh: dolfinx.mesh.Mesh, degree: int) -> None:
        points, _ = quadrature(cell_name(mesh), degree)
        self._found = fem.Expression(expression, points)
        cells = mesh.topology.index_map(mesh.topology.dim)
        # Ghosts too, whose cells some integrals over facets read
        n = cells.size_local + cells.num_ghosts
        size = int(np.prod(expression.ufl_shape))
        self._shape = n, len(points), size
        self._cells = np.arange(n, dtype=np.int32)
        parameters = list(inspect.signature(self._found.eval).parameters)
        self._on = (mesh,) if parameters[0] == "mesh" else ()  # since DOLFINx 0.6

    def __call__(self) -> Array:
        """Evaluate at the present values, (cells, points, components). Ghost cells
        come last."""
        values = self._found.eval(*self._on, self._cells)
        return np.asarray(values, dtype=np.float64).reshape(self._shape)


def set_at_quadrature_points(f: fem.Function, values: Array) -> None:
    """Set a Function on a `quadrature_space` to (cells, points, components) values."""
    V = f.function_space
    table, bs = dofmap_array(V), V.dofmap.index_map_bs
    f.x.array.reshape(-1, bs)[table] = values.reshape(*table.shape, bs)


def cells_as_given(mesh: dolfinx.mesh.Mesh) -> npt.NDArray[np.int64]:
    """Number of each owned cell in the order in which the mesh was given, (cells,).

    It is the same however the mesh is cut into parts. -1 where the mesh does not keep
    it, as one that is a part of another mesh.
    """
    count = mesh.topology.index_map(mesh.topology.dim).size_local
    known = np.asarray(mesh.topology.original_cell_index, dtype=np.int64)
    return known[:count] if len(known) >= count else np.full(count, -1)


def owned_cells(mesh: dolfinx.mesh.Mesh) -> int:
    """Number of cells that this rank owns."""
    return int(mesh.topology.index_map(mesh.topology.dim).size_local)


def turns_with_cells(V: fem.FunctionSpace) -> bool:
    """Whether values of dofs depend on the order of a cell's vertices among all, as of
    edge elements and of Lagrange elements above degree 2."""
    try:
        element: Any = V.element.basix_element
    except RuntimeError:  # mixed elements, and quadrature elements, which have no parts
        return any(turns_with_cells(V.sub(i)) for i in range(V.num_sub_spaces))
    return not element.dof_transformations_are_identity


def values_by_cell(V: fem.FunctionSpace, array: Array) -> Array:
    """Values of a ghosted array in the owned cells, (cells, dofs of a cell)."""
    table = dofmap_array(V)[: owned_cells(V.mesh)]
    found: Array = array.reshape(-1, V.dofmap.index_map_bs)[table]
    return found.reshape(len(table), found.shape[1] * found.shape[2])


def set_by_cell(f: fem.Function, values: Array) -> None:
    """Set a Function to values of `values_by_cell`, and its ghosts. Collective."""
    V, bs = f.function_space, f.function_space.dofmap.index_map_bs
    table = dofmap_array(V)[: owned_cells(V.mesh)]
    f.x.array.reshape(-1, bs)[table] = values.reshape(*table.shape, bs)
    f.x.scatter_forward()
