"""Exceptions, and raising them on every rank at once."""

from __future__ import annotations

from mpi4py import MPI


class ContactError(ValueError):
    """A contact problem that is set up wrongly: bad space, tag, mesh or option."""


class ConvergenceError(RuntimeError):
    """A nonlinear solve, or a path of load steps, that did not converge."""


def raise_everywhere(
    comm: MPI.Comm, message: str | None, exception: type[Exception] = ContactError
) -> None:
    """Raise on all ranks if any rank has something to complain about. Collective.

    An exception on one rank alone leaves the others waiting in the next collective
    call for ever, so every check of the input ends here.

    Parameters
    ----------
    comm
        Communicator of the mesh.
    message
        What is wrong on this rank; ``None`` if nothing is.
    exception
        Type to raise.

    Raises
    ------
    exception
        With the message of the lowest rank that has one, naming that rank if there
        are several.
    """
    complains = message is not None
    rank = comm.allreduce(comm.rank if complains else comm.size, op=MPI.MIN)
    if rank == comm.size:
        return
    text = comm.bcast(message, root=rank)
    raise exception(f"{text} (rank {rank})" if comm.size > 1 else text)
