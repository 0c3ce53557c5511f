"""C++ objects that all ranks must destroy together, kept until every rank has dropped
them. Python frees objects of a reference cycle at any time. A solver is in such a cycle
if a variable keeps a failure with its traceback. One rank would then destroy it while
another one is in a collective call.
"""

from __future__ import annotations

import itertools
from typing import Any

from mpi4py import MPI

# Name: the process that gave it, and a number
Name = tuple[int, int]

_counter = itertools.count()

# The communicator and the object, by a name that all ranks have agreed on
_dropped: dict[Name, tuple[MPI.Comm, Any]] = {}


def agreed_name(comm: MPI.Comm) -> Name:
    """A name for a new object on a communicator. Collective."""
    name: Name = comm.bcast((MPI.COMM_WORLD.rank, next(_counter)), root=0)
    return name


def put_aside(name: Name, comm: MPI.Comm, thing: Any) -> None:
    """Keep an object that this rank has dropped.

    Parameters
    ----------
    name
        Name of the object, from `agreed_name`.
    comm
        Communicator of the object.
    """
    _dropped[name] = comm, thing


def free_dropped(comm: MPI.Comm) -> None:
    """Destroy what all ranks have dropped. Collective."""
    same = MPI.IDENT, MPI.CONGRUENT
    mine = {n for n, (c, _) in _dropped.items() if MPI.Comm.Compare(comm, c) in same}
    for name in sorted(set.intersection(*comm.allgather(mine))):
        del _dropped[name]
