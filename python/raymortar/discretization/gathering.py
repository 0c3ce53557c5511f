"""Meshes and fields on rank 0, for pictures; nodal averages of UFL expressions."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx.fem import Function
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices
from .facets import facets_of_mesh
from .reference_facets import FACET_SHAPE, cell_facet_nodes

# Nodes of a facet of degree 2 in the order around it; every other one is a corner
_AROUND = {
    "interval": [0, 2, 1],
    "triangle": [0, 5, 1, 3, 2, 4],
    "quadrilateral": [0, 4, 1, 6, 3, 7, 2, 5],
}


def gather(comm: MPI.Comm, array: Array) -> Array | None:
    """Join the rows of all ranks on rank 0; None on other ranks. Collective."""
    parts = comm.gather(array, root=0)
    return None if parts is None else np.concatenate(parts)


def nodal_field(
    f: Any,
    mesh: Mesh,
    name: str,
    degree: int = 1,
    quadrature_degree: int | None = None,
) -> Function:
    """A continuous Function for a UFL scalar f: averages, weighted by the shape
    functions. It needs no solve, and stays within the range of f. Give a quadrature
    degree if UFL estimates that of f far too high. Collective.
    """
    field = Function(compat.scalar_space(mesh, degree), name=name)
    v = ufl.TestFunction(field.function_space)
    rule = {"quadrature_degree": quadrature_degree or 2 * degree}
    dx, found = ufl.dx(mesh, metadata=rule), []
    for form in (f * v * dx, v * dx):
        vector = compat.create_la_vector(field.function_space.dofmap.index_map)
        compat.assemble_residual(vector.array, compat.form(form))
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
        found.append(vector.array)
    field.x.array[:] = found[0] / found[1]
    return field


def _gather_nodes(
    mesh: Mesh, x: Array, cells: Indices, nodes: Indices, functions: tuple[Any, ...]
) -> list[Any]:
    """Positions (n, k, 3) of some nodes of cells and values of functions on rank 0."""
    arrays = [x]
    for f in functions:
        V = f.function_space
        dofs = compat.dofmap_array(V)[cells[:, None], nodes]
        arrays.append(f.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs])
    return [gather(mesh.comm, array) for array in arrays]


def gather_cells(mesh: Mesh, *functions: Function) -> list[Any]:
    """Cells of a 2D mesh as polygons, with functions at their vertices. Collective.

    On rank 0 vertices (n, k, 3) in order around the cell, and an array
    (n, k, components) for each continuous Lagrange function; None elsewhere.
    """
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)
    quadrilateral = compat.cell_name(mesh) == "quadrilateral"
    corners = np.tile([0, 1, 3, 2] if quadrilateral else [0, 1, 2], (len(cells), 1))
    x = mesh.geometry.x[compat.geometry_dofmap(mesh)[cells[:, None], corners]]
    return _gather_nodes(mesh, x, cells, corners, functions)


def gather_boundary(
    mesh: Mesh,
    *functions: Function,
    facets: Indices | None = None,
    is_curved: bool = False,
) -> list[Any]:
    """Exterior facets of a mesh, or given ones of this rank, as `gather_cells`.

    Collective. In 2D polygons are ends. Curved ones, in 3D, also have the nodes amid the
    edges, so that edges of degree 2 look curved; all functions are then of degree 2.
    """
    chosen = compat.exterior_facets(mesh) if facets is None else facets
    found = facets_of_mesh(mesh, -1, chosen)
    # The owner of a facet's cell sends the facet: each facet comes once
    own = found.cells < mesh.topology.index_map(mesh.topology.dim).size_local
    cells, local = found.cells[own], found.local_facets[own]
    cell = compat.cell_name(mesh)
    around = _AROUND[FACET_SHAPE[cell]][:: 1 if is_curved else 2]
    nodes = cell_facet_nodes(cell, 2 if is_curved else 1)[:, around][local]
    x, dofs = mesh.geometry.x, compat.geometry_dofmap(mesh)
    if is_curved:
        V = functions[0].function_space
        x, dofs = V.tabulate_dof_coordinates(), compat.dofmap_array(V)
    return _gather_nodes(mesh, x[dofs[cells[:, None], nodes]], cells, nodes, functions)
