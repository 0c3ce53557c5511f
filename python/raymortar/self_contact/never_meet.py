"""Facets that share vertices and never meet: those around sharp edges and corners."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices
from ..core.discretization.facets import N_CORNERS, Global, middle_normals, units
from ..core.discretization.ranks import of_all
from ..core.discretization.surfaces import Surface, corner_ids

# Facets that share a vertex and turn away from each other by more than 45 degrees, their
# middles behind each other, have a wedge of material between them
_SHARP, _IN_PLANE = np.cos(np.pi / 4.0), 1e-6


def facets_that_never_meet(
    slave: Surface, master: Surface, comm: MPI.Comm
) -> tuple[Global, Global]:
    """List the master facets of all ranks that each slave facet never meets.

    They are itself and those beyond a sharp edge or corner, behind which the material
    is [theory (3.14)]. Returns offsets (slave facets + 1,) and global numbers,
    ascending for each slave facet. Collective.
    """
    middles, n = _middles(master)
    ids, corners, middles, n = of_all(
        comm, master.facet_ids, corner_ids(master), middles, n
    )
    mine, mine_n = _middles(slave)
    row, other = _pairs_at_vertices(corner_ids(slave), corners)
    way = middles[other] - mine[row]
    cosine = np.einsum("pd,pd->p", mine_n[row], n[other])
    # Height of either middle over the other facet, relative to their distance, but to the
    # facet's size where that is larger: closed faces of a crack differ by rounding alone
    size = np.linalg.norm(slave.nodes[:, 0] - mine, axis=1)
    length = np.maximum(np.linalg.norm(way, axis=1), size[row])
    heights = np.einsum("pd,kpd->kp", way, np.array([mine_n[row], -n[other]])) / length
    is_notch = (heights > -_IN_PLANE).all(axis=0)
    never = (slave.facet_ids[row] == ids[other]) | ((cosine < _SHARP) & ~is_notch)
    row, number = row[never], ids[other[never]]
    order = np.lexsort([number, row])
    offsets = np.searchsorted(row[order], np.arange(len(mine) + 1))
    return offsets.astype(np.int64), number[order].astype(np.int64)


def _middles(surface: Surface) -> tuple[Array, Array]:
    """Middles of the undeformed facets, by their corners, and unit normals, (n, d)."""
    nodes = surface.nodes[:, : N_CORNERS[surface.shape]]
    return nodes.mean(axis=1), units(middle_normals(surface.shape, 1, nodes))


def _pairs_at_vertices(mine: Global, others: Global) -> tuple[Indices, Indices]:
    """Rows of two tables (facets, corners) that have a number in common, each once."""
    from scipy.sparse import csr_array

    corners = np.concatenate([mine, others])
    known, number = np.unique(corners, return_inverse=True)
    row = np.repeat(np.arange(len(corners)), corners.shape[1])
    shape = len(corners), len(known)
    has = csr_array((np.ones(len(row)), (row, number.ravel())), shape=shape)
    row, met = (has[: len(mine)] @ has[len(mine) :].T).nonzero()
    return row, met
