"""Values that ranks exchange: boxes, sums at dofs, rows; and
objects that all ranks must destroy together.

Python frees objects of a reference cycle at any time. A solver is in such a cycle if a
variable keeps a failure with its traceback. One rank would then destroy its C++ objects
while another one is in a collective call. So they are kept until every rank has dropped
them.
"""

from __future__ import annotations

import itertools
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


# Name of a dropped object: the process that gave it, and a number
Name = tuple[int, int]
_counter = itertools.count()
# The communicator and the object, by a name that all ranks have agreed on
_dropped: dict[Name, tuple[MPI.Comm, Any]] = {}


def agreed_name(comm: MPI.Comm) -> Name:
    """Name a new object on a communicator. Collective."""
    return comm.bcast((MPI.COMM_WORLD.rank, next(_counter)), root=0)


def put_aside(name: Name, comm: MPI.Comm, thing: Any) -> None:
    """Keep an object on a communicator that this rank has dropped."""
    _dropped[name] = comm, thing


def free_dropped(comm: MPI.Comm) -> None:
    """Destroy what all ranks have dropped. Collective."""
    same = MPI.IDENT, MPI.CONGRUENT
    mine = {n for n, (c, _) in _dropped.items() if MPI.Comm.Compare(comm, c) in same}
    for name in sorted(set.intersection(*comm.allgather(mine))):
        del _dropped[name]


def destroy(*things: Any) -> None:
    """Free PETSc objects at once, as petsc4py keeps dropped ones for a while; None is
    nothing. Collective."""
    for thing in things:
        if thing is not None:
            thing.destroy()


# Values of all ranks


def ends_of(x: Array, comm: MPI.Comm) -> Array:
    """Least and largest coordinates of points (n, d) of all ranks, (2, d). Collective."""
    ends = np.stack([x.min(axis=0, initial=np.inf), -x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
    return np.stack([ends[0], -ends[1]])


def largest(comm: MPI.Comm, values: Any) -> float:
    """Largest of the values of all ranks, 0 at least. Collective."""
    return float(comm.allreduce(float(np.max(values, initial=0.0)), op=MPI.MAX))


def of_all(comm: MPI.Comm, *arrays: Any) -> tuple[Any, ...]:
    """Join the rows of all ranks, array by array. Collective."""
    return tuple(np.concatenate(parts) for parts in zip(*comm.allgather(arrays)))


def index_among(numbers: Any, wanted: Any) -> Indices:
    """Index of each wanted number among others in any order; -1: it is not there."""
    if not len(numbers):
        return np.full(len(wanted), -1)
    order = np.argsort(numbers)
    place = np.searchsorted(numbers, wanted, sorter=order)
    found = order[np.minimum(place, len(numbers) - 1)]
    return np.where(numbers[found] == wanted, found, -1)


def sums_at(index_map: Any, width: int, *shares: tuple[Any, Any]) -> Array:
    """Add up rows for block dofs, (dofs, values) each, over all ranks. Collective.

    The sums are at all local dofs, (n, width).
    """
    vector = compat.create_la_vector(index_map, width)
    for dofs, values in shares:
        np.add.at(vector.array.reshape(-1, width), dofs, values)
    # They go to the owner, which may have none itself, and from there to all
    compat.scatter_reverse_add(vector)
    compat.scatter_forward(vector)
    return vector.array.reshape(-1, width).copy()


def count_marks(index_map: Any, entities: Indices, marks: Mask | None = None) -> Array:
    """Count the ranks that have marked each local entity. Collective.

    With marks (n, d) for entities (n,), each of d components is counted, (entities, d).
    """
    chosen = np.unique(entities)
    if marks is None:
        return sums_at(index_map, 1, (chosen, 1.0))[:, 0]
    of_chosen = np.zeros((len(chosen), marks.shape[1]))
    of_chosen[np.searchsorted(chosen, entities)] = marks
    return sums_at(index_map, marks.shape[1], (chosen, of_chosen))


def marked_everywhere(
    V: FunctionSpace, dofs: Indices, marks: Mask | None = None
) -> Mask:
    """Find the block dofs, or components of them, that any rank has marked. Collective.

    Parameters are as those of `count_marks`; a dof may occur more than once.
    """
    return count_marks(V.dofmap.index_map, dofs, marks) > 0.5
