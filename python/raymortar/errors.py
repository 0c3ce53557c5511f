"""Exceptions, and raising them on every rank at once."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np


class ContactError(ValueError):
    """A contact problem that is set up wrongly: bad space, tag, mesh or option."""


class SetUpError(ContactError):
    """A fault of the set-up that no smaller step can cure."""


class ConvergenceError(RuntimeError):
    """A nonlinear solve, or a path of load steps, that did not converge."""


class ContactLost(ConvergenceError):
    """A converged solve in which surfaces have passed each other or a body is free."""


class BodyLeft(ConvergenceError, SetUpError):
    """A solve from which a free body flies away, whatever the step."""


class ContactWarning(UserWarning):
    """A converged solve whose contact is not to be trusted everywhere."""


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
    if comm.size == 1:
        if message is not None:
            raise exception(message)
        return
    complains = message is not None
    rank = comm.allreduce(comm.rank if complains else comm.size, op=MPI.MIN)
    if rank == comm.size:
        return
    text = comm.bcast(message, root=rank)
    raise exception(f"{text} (rank {rank})")


def as_path(name: Any) -> Path:
    """A path that a file may be written to or read from."""
    if not isinstance(name, (str, os.PathLike)):
        raise ContactError(f"the name of a file must be a path, not {name!r}")
    return Path(name)


@contextmanager
def writing(comm: MPI.Comm, path: Any, *kinds: type[Exception]) -> Iterator[None]:
    """Raise on all ranks what keeps any of them from writing a file. Collective.

    Parameters
    ----------
    comm
        Communicator of the mesh.
    path
        For the message.
    kinds
        What the block raises where a file cannot be written.

    Raises
    ------
    ContactError
        That it cannot be written, and why.
    """
    problem = None
    try:
        yield
    except kinds as error:
        problem = f"{path} cannot be written: {error}"
    raise_everywhere(comm, problem)


@contextmanager
def together(comm: MPI.Comm) -> Iterator[None]:
    """What one rank raises in the block, all raise at its end. Collective.

    The block itself must not communicate after the point where a rank may fail. All
    ranks raise the type of the lowest that failed, if it is one of raymortar's or a
    plain one of Python's, else ``RuntimeError``.
    """
    if comm.size == 1:
        yield
        return
    failure: Exception | None = None
    try:
        yield
    except Exception as error:
        failure = error
    rank = comm.allreduce(comm.size if failure is None else comm.rank, op=MPI.MIN)
    if rank == comm.size:
        return
    kind = next((k for k in _SENT if type(failure) is k), RuntimeError)
    kind, text = comm.bcast((kind, str(failure)), root=rank)
    raise kind(f"{text} (rank {rank})") from failure


_SENT = (ContactError, SetUpError, ConvergenceError, ValueError, TypeError, IndexError)


def _signature(value: Any) -> Any:
    """Text that two ranks have alike if they were given the same."""
    if is_dataclass(value) and not isinstance(value, type):
        parts = [
            f"{f.name}={_signature(getattr(value, f.name))}" for f in fields(value)
        ]
        return f"{type(value).__name__}({', '.join(parts)})"
    if hasattr(value, "function_space"):
        return type(value).__name__  # its values may differ, and its address does
    if callable(value) and not isinstance(value, type):
        return f"callable {getattr(value, '__qualname__', type(value).__name__)}"
    if isinstance(value, (list, tuple)):
        return [_signature(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()  # NumPy 2 spells the type out
    return repr(value)


def require_agreement(comm: MPI.Comm, **arguments: Any) -> None:
    """Raise on all ranks unless all were given the same arguments. Collective.

    Parameters
    ----------
    comm
        Communicator of the mesh.
    arguments
        By name. Functions need only be functions on all ranks, callables have a name.

    Raises
    ------
    SetUpError
        Naming the first argument that differs, with two of its values.
    """
    if comm.size == 1:
        return
    mine = {name: _signature(value) for name, value in arguments.items()}
    first = comm.bcast(mine, root=0)
    message = next(
        (
            f"{name} differs between ranks: {text} and, on rank 0, {first[name]}"
            for name, text in mine.items()
            if text != first[name]
        ),
        None,
    )
    raise_everywhere(comm, message, SetUpError)
