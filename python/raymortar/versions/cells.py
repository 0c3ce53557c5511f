"""Numbers of cells, and values by cell."""

from __future__ import annotations

from typing import Any

import dolfinx.mesh
import numpy as np
import numpy.typing as npt
from dolfinx import fem

from ..core.compat import Array, dofmap_array


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
