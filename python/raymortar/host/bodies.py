"""Bodies of a mesh: cells that are connected by shared nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace

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
    """For each of n entities, the smallest one that it is connected to.

    Parameters
    ----------
    rows
        Entities that each row ties to each other, (rows, entities per row).
    n
        Number of entities.
    """
    lowest = np.arange(n, dtype=rows.dtype)
    while len(rows):
        roots = lowest[rows]
        low = roots.min(axis=1)
        apart = (roots > low[:, None]).any(axis=1)
        rows, roots, low = rows[apart], roots[apart], low[apart]
        # Several rows may move one root: one of them is enough, as the others come
        # again
        for column in roots.T:
            lowest[column] = np.minimum(lowest[column], low)
        while (lowest != lowest[lowest]).any():
            lowest = lowest[lowest]
    return lowest


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
    """Connected part of each local dof, and their number on all ranks. Collective.

    Parameters
    ----------
    comm
        Communicator of the mesh.
    index_map
        Index map of the dofs. rows
        Block dofs that each of this rank's rows ties to each other, (rows, n).
    used
        Marks the dofs that count, on every rank that has them. Others get -1. None: all
        count.
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
