"""Meshes out of arrays, and where their cells go."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import dolfinx
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import cpp as _cpp

from ..core.compat import HAS_UFL_ELEMENTS, Indices, basix_element
from ..core.errors import ContactError, together


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


def _ranks_across_facets(
    cells: npt.NDArray[np.int64], cell: str, ranks: Indices
) -> list[set[int]]:
    """Other ranks that have a cell across a facet, for each of the cells."""
    columns = np.array(basix_element(cell, 1).facet_vertices)
    facets = np.sort(cells[:, columns], axis=2).reshape(-1, columns.shape[1])
    of_cell = np.repeat(np.arange(len(cells)), len(columns))
    order = np.lexsort(facets.T)
    same = np.all(facets[order][1:] == facets[order][:-1], axis=1)
    pairs = np.column_stack([of_cell[order][:-1][same], of_cell[order][1:][same]])
    others: list[set[int]] = [set() for _ in cells]
    for a, b in pairs[ranks[pairs[:, 0]] != ranks[pairs[:, 1]]]:
        others[a].add(int(ranks[b]))
        others[b].add(int(ranks[a]))
    return others


def as_destinations(ranks: npt.ArrayLike, count: int, size: int) -> Indices:
    """Check the ranks of so many cells: whole numbers from 0 to ``size - 1``."""
    found = np.asarray(ranks)
    if found.shape != (count,) or not np.issubdtype(found.dtype, np.integer):
        raise ContactError(
            f"partition must give the rank of each of the {count} cells, whole numbers "
            f"of shape ({count},), not {found.dtype} of shape {found.shape}"
        )
    wrong = np.flatnonzero((found < 0) | (found >= size))
    if len(wrong):
        raise ContactError(
            f"partition gives cell {wrong[0]} to rank {found[wrong[0]]}, of {size} ranks"
        )
    return found.astype(np.int32)


def given_partition(cells: npt.NDArray[np.int64], cell: str, ranks: Indices) -> Any:
    """Partitioner that sends each of this rank's cells to a given rank.

    Cells have their nodes in Basix order, (n_cells, n). The name of the cell type may be
    anything where there are no cells.
    """
    rows = [[rank] for rank in ranks.tolist()]
    if HAS_UFL_ELEMENTS and rows:
        # It knows the vertices that ranks share from ghosts alone, which it drops later
        others = _ranks_across_facets(cells, cell, ranks)
        rows = [row + sorted(more) for row, more in zip(rows, others)]
    offsets = np.cumsum([0] + [len(row) for row in rows], dtype=np.int32)
    data = np.array([rank for row in rows for rank in row], dtype=np.int32)
    # Its arguments differ between versions, and none of them is needed
    return lambda *_: _cpp.graph.AdjacencyList_int32(data, offsets)


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
