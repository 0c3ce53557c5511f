"""Functions that terms of the equations bring: on some facets alone, or one number."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function, FunctionSpace

from . import versions
from .core import compat
from .core.compat import Array, Indices
from .core.discretization.facets import (
    FACET_SHAPE,
    N_CORNERS,
    Facets,
    coordinates,
    facet_node_table,
    facet_nodes,
    match_points,
    shape_functions,
)
from .core.discretization.ranks import keep_communicator


def function_on_facets(V: FunctionSpace, facets: Facets, name: str) -> Any:
    """Make a Function of a space's element on facets alone. Collective.

    Its mesh is that of the facets, straight, so it has no other dofs.

    Returns
    -------
    f, table
        The Function, and its local block dofs on each of the facets, in the order of
        `facet_dof_table`, (facets, n).
    """
    info, mesh, comm = compat.element_info(V), V.mesh, V.mesh.comm
    shape = FACET_SHAPE[compat.cell_name(mesh)]
    corners = facet_node_table(mesh, facets)[:, : N_CORNERS[shape]]
    numbers, x = compat.geometry_nodes_global(mesh)[corners], coordinates(mesh)[corners]
    # Corners in the order of Basix
    vertices = compat.basix_element(shape, 1).points
    order = match_points(facet_nodes(shape, 1), vertices)
    surface = _gathered_mesh(comm, numbers[:, order], x[:, order], shape)
    space = compat.space(surface, "Lagrange", info.degree, info.value_shape)
    f = Function(space, name=name)
    N, _ = shape_functions(shape, 1, facet_nodes(shape, info.degree))
    nodes = np.einsum("an,fnd->fad", N, x)
    return f, _dofs_at(f, np.pad(nodes, ((0, 0), (0, 0), (0, 3 - x.shape[2]))))


def _gathered_mesh(comm: MPI.Comm, cells: Any, x: Array, cell: str) -> Any:
    """Mesh of cells with global numbers of their corners, which stay on their ranks.
    Collective."""
    gathered = comm.gather((cells, x), root=0)
    points, ranks = np.empty((0, x.shape[2])), np.empty(0, dtype=np.int32)
    table = np.empty((0, cells.shape[1]), dtype=np.int64)
    if gathered is not None:
        ranks = np.repeat(np.arange(comm.size), [len(one) for one, _ in gathered])
        every = np.concatenate([one for one, _ in gathered])
        _, first, table = np.unique(every, return_index=True, return_inverse=True)
        points = np.concatenate([one for _, one in gathered]).reshape(-1, x.shape[2])
        points, table = points[first], table.reshape(every.shape)
    mesh = versions.create_mesh(comm, table, points, cell, destinations=ranks)
    keep_communicator(mesh)
    return mesh


def _dofs_at(f: Function, x: Array) -> Indices:
    """Find a Function's local block dofs at their positions (..., 3)."""
    if x.size == 0:
        return np.empty(x.shape[:-1], dtype=np.int32)
    from scipy.spatial import cKDTree

    nodes = f.function_space.tabulate_dof_coordinates()
    _, found = cKDTree(nodes).query(x)
    return np.asarray(found, dtype=np.int32)


def single_number(comm: MPI.Comm, name: str) -> Function:
    """Make a Function with one dof in all, on the first rank. Collective."""
    here = int(comm.rank == 0)
    cells, x = np.arange(2)[None][:here], np.arange(2.0)[None, :, None][:here]
    mesh = _gathered_mesh(comm, cells, x, "interval")
    return Function(compat.space(mesh, "DG", 0), name=name)
