"""Bodies of a mesh: cells that are connected by shared nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import FunctionSpace
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .. import compat
from ..compat import Indices, Mask
from .facets import Global
from .joined import JoinedSpace
from .ranks import of_all


@dataclass(frozen=True)
class Bodies:
    """The body of each node, the same on any number of ranks."""

    count: int  # on all ranks together
    # Of each local block dof, ghosts last; numbered alike on all ranks, in any order
    dofs: Indices


def bodies_of_facets(bodies: Bodies, surface: Any) -> Indices:
    """Body of each facet of a `surfaces.Surface`, (facets,)."""
    return bodies.dofs[surface.dofs[surface.facet_dofs[:, 0]]]


def connected(rows: Indices, n: int) -> Global:
    """Find the smallest of the entities that each of n entities is connected with."""
    one, other = np.repeat(rows[:, 0], rows.shape[1] - 1), rows[:, 1:].ravel()
    graph = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(n, n))
    _, part = connected_components(graph, directed=False)
    _, first = np.unique(part, return_index=True)
    return first[part]


def find_parts(
    comm: MPI.Comm, index_map: Any, rows: Indices, used: Mask | None = None
) -> tuple[Indices, int]:
    """Find the connected part of each local dof, and their number on all ranks.

    Rows (rows, n) have the block dofs that they tie to each other. Dofs that are not
    used, on every rank that has them, get -1. Collective.
    """
    n = index_map.size_local + index_map.num_ghosts
    used = np.ones(n, dtype=bool) if used is None else used
    parts, part = np.unique(connected(rows, n)[used], return_inverse=True)
    # Number the parts of all ranks, and find those that share a node
    counts = np.array(comm.allgather(len(parts)))
    owners = compat.create_la_vector(index_map)
    owners.array[:] = -1.0
    owners.array[used] = mine = counts[: comm.rank].sum() + part
    compat.scatter_forward(owners)
    ties = np.column_stack([mine, owners.array[used].astype(np.int64)])
    lowest = connected(of_all(comm, np.unique(ties, axis=0))[0], int(counts.sum()))
    roots, joined = np.unique(lowest, return_inverse=True)
    found = np.full(n, -1, dtype=np.int32)
    found[used] = joined[mine]
    return found, len(roots)


def find_bodies(V: FunctionSpace | JoinedSpace) -> Bodies:
    """Find the connected parts of the mesh, or meshes, of a continuous space. Collective."""
    if not isinstance(V, JoinedSpace):
        dofmap = V.dofmap
        dofs, count = find_parts(V.mesh.comm, dofmap.index_map, compat.dofmap_array(V))
        return Bodies(count, dofs)
    # Bodies of several meshes, one after the other
    parts, count = [find_bodies(part) for part in V.parts], 0
    dofs = np.empty(sum(len(one.dofs) for one in parts), dtype=np.int32)
    for one, places in zip(parts, V.index_map.places):
        dofs[places] = one.dofs + count
        count += one.count
    return Bodies(count, dofs)
