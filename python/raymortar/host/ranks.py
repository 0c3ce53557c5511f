"""Values that ranks tell each other: boxes, marks at dofs, rows, counts of messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import FunctionSpace

from .. import compat
from ..compat import Array, Indices, Mask

_NAME = "_raymortar_communicator"


def keep_communicator(mesh: Any) -> None:
    """Hold PETSc's own communicator of a mesh for as long as it lives. Collective.

    PETSc makes a communicator with its first object on a mesh, collectively, and frees
    it with the last one. Python's collector destroys objects on each rank at another
    time. So one rank might still have the communicator while another one makes a new
    one, and both would wait for ever.
    """
    if not hasattr(mesh, _NAME):
        vector = PETSc.Vec().createMPI((0, None), comm=mesh.comm)
        setattr(mesh, _NAME, vector)


def ends_of(x: Array, comm: MPI.Comm) -> Array:
    """Least and largest coordinates of points (n, d) of all ranks, (2, d). Collective."""
    ends = np.stack([x.min(axis=0, initial=np.inf), -x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
    return np.stack([ends[0], -ends[1]])


def count_marks(index_map: Any, entities: Indices, marks: Mask | None = None) -> Array:
    """Count the ranks that have marked each local entity. Collective.

    With marks (n, d) for entities (n,), each of d components is counted, (entities, d).
    """
    d = 1 if marks is None else marks.shape[1]
    vector = compat.create_la_vector(index_map, d)
    vector.array.reshape(-1, d)[entities] = 1.0 if marks is None else marks
    # Marks go to the owner, which may have marked none itself, and from there to all
    compat.scatter_reverse_add(vector)
    compat.scatter_forward(vector)
    counts: Array = vector.array.copy()
    return counts if marks is None else counts.reshape(-1, d)


def marked_everywhere(
    V: FunctionSpace, dofs: Indices, marks: Mask | None = None
) -> Mask:
    """Find the block dofs, or components of them, that any rank has marked. Collective.

    Parameters are as those of `count_marks`; a dof may occur more than once.
    """
    return count_marks(V.dofmap.index_map, dofs, marks) > 0.5


@dataclass(frozen=True)
class Sent:
    """Counts of messages from one rank to another.

    ``pairing_*``: sent to find partners and to exchange facets, whenever facets have
    moved too far to keep the last ones. ``value_*``: displacements at the dofs of those
    facets, sent at every update. Both are sums since the contact was made.
    ``*_entries``: entries of the contact's matrix and residual in rows of other ranks,
    which PETSc sends at one assembly to ``entry_ranks`` ranks.
    """

    pairing_messages: int = 0
    pairing_bytes: int = 0
    value_messages: int = 0
    value_bytes: int = 0
    matrix_entries: int = 0
    vector_entries: int = 0
    entry_ranks: int = 0


@dataclass(frozen=True)
class Communication:
    """Sums over all ranks, and for each count the largest one of a rank."""

    total: Sent = Sent()
    largest: Sent = Sent()


def communication(
    traffic: Sequence[Mapping[str, int]], comm: MPI.Comm
) -> Communication:
    """Add up counts of this rank's zones, and those of all ranks. Collective."""
    counts = np.array([astuple(Sent()), *(astuple(Sent(**one)) for one in traffic)])
    total = comm.allreduce(counts.sum(axis=0), op=MPI.SUM)
    largest = np.array(comm.allgather(counts.sum(axis=0))).max(axis=0)
    return Communication(Sent(*total.tolist()), Sent(*largest.tolist()))
