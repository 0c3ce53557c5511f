"""C++ objects that all ranks must destroy together, kept until all have dropped them.

Python frees what hangs in a cycle, as a solver does in the traceback of a failure that a
variable keeps, when it likes: on one rank within another's collective call.
"""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

# By number, the same on all ranks: the communicator and the object
_dropped: dict[int, tuple[MPI.Comm, Any]] = {}


def put_aside(number: int, comm: MPI.Comm, thing: Any) -> None:
    """Keep what this rank has dropped.

    Parameters
    ----------
    number
        Of the object, the same on all ranks.
    comm
        That the object lives on.
    """
    _dropped[number] = comm, thing


def free_dropped(comm: MPI.Comm) -> None:
    """Destroy what all ranks have dropped. Collective."""
    same = MPI.IDENT, MPI.CONGRUENT
    mine = {n for n, (c, _) in _dropped.items() if MPI.Comm.Compare(comm, c) in same}
    for number in sorted(set.intersection(*comm.allgather(mine))):
        del _dropped[number]
