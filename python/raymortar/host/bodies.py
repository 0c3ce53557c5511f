"""Bodies of a mesh: cells that are connected by shared nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .. import compat
from ..compat import Array, Indices
from .joined import JoinedSpace


@dataclass(frozen=True)
class Bodies:
    """The body of each node, the same on any number of ranks.

    Attributes
    ----------
    count
        Number of bodies, on all ranks together.
    dofs
        Body of each local block dof, ghosts last, (n_dofs,), int32. Bodies are numbered
        alike on all ranks, in an order without meaning.
    """

    count: int
    dofs: Indices


def bodies_of_facets(bodies: Bodies, surface: Any) -> Indices:
    """Body of each facet of a `surfaces.Surface`, (facets,)."""
    return bodies.dofs[surface.dofs[surface.facet_dofs[:, 0]]]


def connected(rows: Indices, n: int) -> Indices:
    """Find the smallest of n entities that each is connected to.

    Each of the rows ties its entities to each other, (rows, entities per row).
    """
    ties = np.repeat(rows[:, 0], rows.shape[1]), rows.ravel()
    graph = coo_matrix((np.ones(rows.size), ties), shape=(n, n))
    part = connected_components(graph, directed=False)[1]
    _, lowest, which = np.unique(part, return_index=True, return_inverse=True)
    found: Indices = lowest[which].astype(rows.dtype)
    return found


def _owners(values: Array, index_map: object) -> Array:
    """The owners' values, at owned entries and ghosts. Collective."""
    vector = compat.create_la_vector(index_map)
    vector.array[:] = values
    compat.scatter_forward(vector)
    return vector.array.copy()


def find_parts(
    comm: MPI.Comm,
    index_map: Any,
    rows: Indices,
    used: npt.NDArray[np.bool_] | None = None,
) -> tuple[Indices, int]:
    """Find the connected part of each local dof, and their number on all ranks.

    Rows are block dofs that each row of this rank ties to each other, (rows, n). Used
    marks the dofs that count, on every rank that has them, by default all; others get
    -1. Collective.
    """
    n = index_map.size_local + index_map.num_ghosts
    used = np.ones(n, dtype=bool) if used is None else used
    parts, part = np.unique(connected(rows, n)[used], return_inverse=True)
    # Number the parts of all ranks, and find those that share a node
    counts = np.array(comm.allgather(len(parts)))
    mine = np.full(n, -1)
    mine[used] = counts[: comm.rank].sum() + part
    theirs = _owners(mine, index_map).astype(np.int64)
    ties = np.unique(np.column_stack([mine, theirs])[used], axis=0)
    lowest = connected(np.concatenate(comm.allgather(ties)), int(counts.sum()))
    roots, joined = np.unique(lowest, return_inverse=True)
    found = np.full(n, -1, dtype=np.int32)
    found[used] = joined[mine[used]]
    return found, len(roots)


def find_bodies(V: FunctionSpace | JoinedSpace) -> Bodies:
    """Connected parts of the mesh, or meshes, of a space of continuous functions.
    Collective."""
    if isinstance(V, JoinedSpace):
        return _joined([find_bodies(part) for part in V.parts], V)
    dofmap = V.dofmap
    dofs, count = find_parts(V.mesh.comm, dofmap.index_map, compat.dofmap_array(V))
    return Bodies(count, dofs)


def _joined(parts: list[Bodies], V: JoinedSpace) -> Bodies:
    """Bodies of several meshes, one after the other."""
    dofs, count = np.empty(sum(len(one.dofs) for one in parts), dtype=np.int32), 0
    for one, places in zip(parts, V.index_map.places):
        dofs[places] = one.dofs + count
        count += one.count
    return Bodies(count, dofs)
