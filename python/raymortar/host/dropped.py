"""C++ objects that all ranks must destroy together, kept until all have dropped them.

Python frees what hangs in a cycle, as a solver does in the traceback of a failure that a
variable keeps, when it likes: on one rank within another's collective call.
"""

from __future__ import annotations

import itertools
from typing import Any

from mpi4py import MPI

# Process that has given a number, and the number
Name = tuple[int, int]

_counter = itertools.count()

# The communicator and the object, by a name that all ranks have agreed on
_dropped: dict[Name, tuple[MPI.Comm, Any]] = {}


def agreed_name(comm: MPI.Comm) -> Name:
    """Name of a new object that lives on a communicator. Collective."""
    name: Name = comm.bcast((MPI.COMM_WORLD.rank, next(_counter)), root=0)
    return name


def put_aside(name: Name, comm: MPI.Comm, thing: Any) -> None:
    """Keep what this rank has dropped.

    Parameters
    ----------
    name
        Of the object, see `agreed_name`.
    comm
        That the object lives on.
    """
    _dropped[name] = comm, thing


def free_dropped(comm: MPI.Comm) -> None:
    """Destroy what all ranks have dropped. Collective."""
    same = MPI.IDENT, MPI.CONGRUENT
    mine = {n for n, (c, _) in _dropped.items() if MPI.Comm.Compare(comm, c) in same}
    for name in sorted(set.intersection(*comm.allgather(mine))):
        del _dropped[name]
