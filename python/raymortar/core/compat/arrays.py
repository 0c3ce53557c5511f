"""Meshes out of arrays."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import dolfinx
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import cpp as _cpp

from ..errors import together
from .generation import HAS_UFL_ELEMENTS
from .meshes import as_destinations, given_partition


def _mesh_domain(cell: str, degree: int, gdim: int) -> ufl.Mesh:
    """UFL mesh with a Lagrange coordinate element."""
    if HAS_UFL_ELEMENTS:
        ufl_cell = ufl.Cell(cell, geometric_dimension=gdim)
        return ufl.Mesh(ufl.VectorElement("Lagrange", ufl_cell, degree))
    import basix.ufl

    # Equispaced, as for the meshes that DOLFINx builds or reads itself.
    variant = basix.LagrangeVariant.equispaced
    return ufl.Mesh(basix.ufl.element("Lagrange", cell, degree, variant, shape=(gdim,)))


def _default_partitioner(ghosts: bool) -> Any:
    """DOLFINx's, from 0.9 on with or without a layer of ghost cells."""
    if HAS_UFL_ELEMENTS:
        return _cpp.mesh.create_cell_partitioner()
    modes = dolfinx.mesh.GhostMode
    mode = modes.shared_facet if ghosts else modes.none
    try:
        return dolfinx.mesh.create_cell_partitioner(mode)
    except TypeError:  # 0.11 also wants the most cells that meet in a facet
        return dolfinx.mesh.create_cell_partitioner(mode, 2)


def create_mesh(
    comm: MPI.Comm,
    cells: npt.ArrayLike,
    points: npt.ArrayLike,
    cell: str,
    degree: int = 1,
    ghosts: bool = False,
    destinations: npt.ArrayLike | None = None,
) -> dolfinx.mesh.Mesh:
    """Mesh from arrays. Collective.

    Parameters
    ----------
    comm
        Communicator over which to distribute the cells.
    cells
        Nodes of each cell in Basix order, shape (n_cells, n), indices into the
        points of all ranks together; other ranks pass zero rows.
    points
        Coordinates, shape (n_points, gdim). Length.
    cell
        Name of the cell type.
    degree
        Degree of the geometry.
    ghosts
        Whether to keep one layer of ghost cells (cells across a shared facet).
    destinations
        Rank that gets each of the cells, shape (n_cells,), without ghosts; all cells
        must then be passed by one rank. Default: up to DOLFINx's graph partitioner.

    Raises
    ------
    ContactError
        If destinations are not one rank for each cell.
    """
    if ghosts and destinations is not None:
        raise ValueError("destinations and ghosts exclude each other")
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    points = np.ascontiguousarray(points, dtype=np.float64)
    domain = _mesh_domain(cell, degree, points.shape[1])
    if destinations is None:
        partitioner = _default_partitioner(ghosts)
    else:
        with together(comm):
            ranks = as_destinations(destinations, len(cells), comm.size)
        partitioner = given_partition(cells, cell, ranks)
    if not HAS_UFL_ELEMENTS:
        # By name: 0.10 swapped the order of the points and the element.
        return dolfinx.mesh.create_mesh(
            comm, cells=cells, x=points, e=domain, partitioner=partitioner
        )
    modes = dolfinx.mesh.GhostMode
    return dolfinx.mesh.create_mesh(
        comm,
        _cpp.graph.AdjacencyList_int64(cells),
        points,
        domain,
        ghost_mode=modes.shared_facet if ghosts else modes.none,
        partitioner=partitioner,
    )
