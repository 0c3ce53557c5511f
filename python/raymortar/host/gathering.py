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
from .reference_facets import FACET_SHAPE, cell_facet_nodes

# Nodes of a facet of degree 2 in the order around it
_AROUND = {"triangle": [0, 5, 1, 3, 2, 4], "quadrilateral": [0, 4, 1, 6, 3, 7, 2, 5]}


def gather(comm: MPI.Comm, array: Array) -> Array | None:
    """Rows of all ranks, one after the other, on rank 0; None on other ranks.
    Collective."""
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
    V = field.function_space
    v = ufl.TestFunction(V)
    sums, weights = (
        compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        for _ in range(2)
    )
    rule = quadrature_degree or 2 * degree
    dx = ufl.dx(mesh, metadata={"quadrature_degree": rule})
    compat.assemble_residual(sums.array, compat.form(f * v * dx))
    compat.assemble_residual(weights.array, compat.form(v * dx))
    for vector in (sums, weights):
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
    field.x.array[:] = sums.array / weights.array
    return field


def _corner_values(function: Function, cells: Indices, corners: Indices) -> Array:
    """Values at some vertices of cells: (n, corners, components)."""
    V = function.function_space
    dofs = compat.dofmap_array(V)[cells[:, None], corners]
    return function.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs]


def _gather_corners(
    mesh: Mesh, cells: Indices, corners: Indices, functions: tuple[Function, ...]
) -> list[Any]:
    """Vertices (n, k, 3) of pieces of cells, and functions there, on rank 0."""
    nodes = compat.geometry_dofmap(mesh)[cells[:, None], corners]
    arrays = [mesh.geometry.x[nodes]]
    arrays += [_corner_values(f, cells, corners) for f in functions]
    return [gather(mesh.comm, array) for array in arrays]


def gather_cells(mesh: Mesh, *functions: Function) -> list[Any]:
    """Cells of a 2D mesh as polygons, with functions at their vertices. Collective.

    Returns
    -------
    On rank 0 vertices (n, k, 3) in order around the cell, and an array
    (n, k, components) for each continuous Lagrange function; None elsewhere.
    """
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)
    quadrilateral = compat.cell_name(mesh) == "quadrilateral"
    order = [0, 1, 3, 2] if quadrilateral else [0, 1, 2]
    corners = np.tile(np.array(order, dtype=np.int32), (len(cells), 1))
    return _gather_corners(mesh, cells, corners, functions)


def gather_boundary(
    mesh: Mesh,
    *functions: Function,
    facets: Indices | None = None,
    is_curved: bool = False,
) -> list[Any]:
    """Exterior facets of a mesh, or given ones, as polygons, in 2D their ends; see
    `gather_cells`.

    Collective.

    Parameters
    ----------
    mesh
        The mesh.
    functions
        Functions on it. All are of degree 2 if facets are curved.
    facets
        Facets of this rank. None: all exterior ones.
    is_curved
        Whether polygons, in 3D, also have the nodes amid the edges, so that edges of degree 2
        look curved.
    """
    dim = mesh.topology.dim
    owned = mesh.topology.index_map(dim).size_local
    chosen = compat.exterior_facets(mesh) if facets is None else facets
    f_to_c = compat.connectivity(mesh, dim - 1, dim)
    cells = np.array([f_to_c.links(f)[0] for f in chosen], dtype=np.int32)
    # The owner of a facet's cell sends the facet: each facet comes once
    chosen, cells = chosen[cells < owned], cells[cells < owned]
    c_to_f = compat.connectivity_table(mesh, dim, dim - 1)
    local = np.argmax(c_to_f[cells] == chosen[:, None], axis=1)
    cell = compat.cell_name(mesh)
    if is_curved:
        around = _AROUND[FACET_SHAPE[cell]]
        nodes = cell_facet_nodes(cell, 2)[:, around][local].reshape(-1, len(around))
        x = _node_positions(functions[0], cells, nodes)
        values = [_corner_values(f, cells, nodes) for f in functions]
        return [gather(mesh.comm, array) for array in (x, *values)]
    table = compat.basix_element(cell, 1).facet_vertices
    order = [0, 1, 3, 2] if len(table[0]) == 4 else list(range(len(table[0])))
    corners = np.array(table, dtype=np.int32)[:, order][local]
    return _gather_corners(mesh, cells, corners.reshape(-1, len(order)), functions)


def _node_positions(function: Function, cells: Indices, nodes: Indices) -> Array:
    """Undeformed positions of some nodes of cells, (n, nodes, 3)."""
    V = function.function_space
    dofs = compat.dofmap_array(V)[cells[:, None], nodes]
    positions: Array = V.tabulate_dof_coordinates()[dofs]
    return positions
