"""Exceptions, raising them on every rank at once, and checks of arguments."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import FunctionType
from typing import Any

from mpi4py import MPI

import numpy as np


class ContactError(ValueError):
    """A contact problem that is set up wrongly: bad space, tag, mesh or option."""


class SetUpError(ContactError):
    """A fault of the set-up that no smaller step can cure."""


class NotFinite(ContactError):
    """Unknowns that are no numbers: of an iterate, a solve that did not converge."""


class ConvergenceError(RuntimeError):
    """A nonlinear solve, or a path of load steps, that did not converge."""


class ContactLost(ConvergenceError):
    """A converged solve in which surfaces have passed each other or a body is free."""


class BodyLeft(ConvergenceError, SetUpError):
    """A solve from which a free body flies away, whatever the step."""


class ContactWarning(UserWarning):
    """A converged solve whose contact is not to be trusted everywhere."""


# Whether this rank shows warnings: it is the first of a communicator of a contact
_speaks: bool | None = None
# Frames that are not the user's: of this package, and of context managers and cached
# properties in it
_OWN_CODE = (
    str(Path(__file__).parents[1]) + os.sep,
    contextlib.__file__,
    functools.__file__,
)


def speak_on(comm: MPI.Comm) -> None:
    """Let warnings be shown by the first rank of a communicator, here for one."""
    global _speaks
    _speaks = bool(_speaks) or comm.rank == 0


def warn(text: str, page: str = "warnings") -> None:
    """Warn with `ContactWarning` at the user's own line of code, with a page of the
    appendix of messages that explains it; "" for none.

    All ranks warn, so that filters which raise or record do so on all alike; one shows it.
    """
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_OWN_CODE):
        frame, level = frame.f_back, level + 1
    speaks = MPI.COMM_WORLD.rank == 0 if _speaks is None else _speaks
    # A recorder of warnings puts a list's method in place of this function
    shows = isinstance(getattr(warnings, "_showwarnmsg_impl", None), FunctionType)
    shown = warnings.showwarning
    if not speaks and shows:
        warnings.showwarning = _show_nothing
    try:
        link = f" (docs/messages/{page}.md)" if page else ""
        warnings.warn(text + link, ContactWarning, stacklevel=level)
    finally:
        warnings.showwarning = shown


def _show_nothing(*_: Any, **__: Any) -> None:
    """Leave it to the rank that speaks."""


# Types that are raised on all ranks as they are
_OURS = (ContactError, SetUpError, NotFinite, ConvergenceError, ContactLost, BodyLeft)
_SENT = (*_OURS, ValueError, TypeError, IndexError, MemoryError)


@contextmanager
def together(comm: MPI.Comm) -> Iterator[None]:
    """Raise at the end of the block, on all ranks, what any rank raises in it.

    Collective. An exception on one rank alone leaves the others waiting in the next
    collective call for ever. The block itself must not communicate after the point
    where a rank may fail. All ranks raise the message of the lowest that failed, and
    its type, if that is one of raymortar's or a plain one of Python's, else
    ``RuntimeError``.
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


def raise_everywhere(
    comm: MPI.Comm, message: str | None, exception: type[Exception] = ContactError
) -> None:
    """Raise on all ranks if any rank has a message, as `together` does. Collective."""
    with together(comm):
        if message is not None:
            raise exception(message)


def _signature(value: Any) -> Any:
    """Describe a value by a text that two ranks have alike if they were given it."""
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
    """Raise `SetUpError` on all ranks unless all were given the same. Collective.

    Functions need only be Functions on all ranks, callables have the same name. The
    message names the first argument that differs, with two of its values.
    """
    if comm.size == 1:
        return
    mine = {name: _signature(value) for name, value in arguments.items()}
    first = comm.bcast(mine, root=0)
    with together(comm):
        for name, text in mine.items():
            if text != first[name]:
                raise SetUpError(
                    f"{name} differs between ranks: {text} and, on rank 0, {first[name]}"
                )


# Longest text of a value in a message, and most members of a list
_LONGEST, _MOST = 120, 4


def described(value: Any) -> str:
    """Describe any value for a message, in a line: Functions by name, shape and element."""
    if hasattr(value, "function_space") and hasattr(value, "ufl_shape"):
        name = getattr(value, "name", "")
        element = value.function_space.ufl_element()
        return f"the Function {name!r} with values {value.ufl_shape} in {element}"
    if hasattr(value, "dofmap") and hasattr(value, "ufl_element"):
        return f"a space of {value.ufl_element()}"
    if hasattr(value, "ufl_shape"):
        return f"a UFL expression with values {value.ufl_shape}"
    if isinstance(value, np.ndarray) and value.size > _MOST:
        return f"an array {value.shape}"
    if isinstance(value, (list, tuple)):
        more = [f"... {len(value)} in all"] * (len(value) > _MOST)
        return f"[{', '.join([*map(described, value[:_MOST]), *more])}]"
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ..."


def spoken_tag(tag: int | str, name: str | None) -> str:
    """A tag for a message, with its name if it has one."""
    if isinstance(tag, str):  # all facets
        return repr(tag)
    return f"tag {tag}" if name is None else f"{name!r} (tag {tag})"


def format_point(point: Any, others: Any = (), digits: int = 6) -> str:
    """A point as text, for a message: coordinates that are noise beside its own and
    those of other points, such as all of its body, are 0."""
    found = np.asarray(point, dtype=float)
    size = max(np.abs(values).max(initial=0.0) for values in (found, others))
    found = np.where(np.abs(found) < 10.0**-digits * size, 0.0, found)
    return f"({', '.join(f'{x:.{digits}g}' for x in found)})"


def is_real_number(value: Any) -> bool:
    """Whether a value is one real number, finite or not; True is none."""
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    return number and bool(np.isreal(value))


def is_whole_number(value: Any) -> bool:
    """Whether a value is of an integer type, of Python or NumPy; True is none."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def is_truth_value(value: Any) -> bool:
    """Whether a value is True or False, of Python or NumPy."""
    return isinstance(value, (bool, np.bool_))


def is_one_of(value: Any, names: tuple[str, ...]) -> bool:
    """Whether a value is one of some texts; arrays compare entry by entry."""
    return isinstance(value, str) and value in names


def positive(name: str, value: Any) -> float:
    """Check a positive number."""
    if not (is_real_number(value) and np.isfinite(value) and value > 0.0):
        raise ContactError(f"{name} = {value!r} must be a positive number")
    return float(value)


def truth(name: str, value: Any) -> bool:
    """Check that a value is True or False."""
    if not is_truth_value(value):
        raise ContactError(f"{name} = {value!r} must be True or False")
    return bool(value)


def choice(name: str, value: Any, names: tuple[str, ...]) -> str:
    """Check that a value is one of some texts."""
    if not is_one_of(value, names):
        raise ContactError(f"{name} must be one of {names}, not {value!r}")
    return str(value)


def of_type(name: str, value: Any, kind: type, wanted: str) -> None:
    """Raise unless a value is of a type, which the message calls ``wanted``."""
    if not isinstance(value, kind):
        raise ContactError(f"{name} must be {wanted}, not {type(value).__name__}")


class Options:
    """Options that are checked when made, or on several ranks when they are used.

    Making one is no collective call. What is wrong on one rank alone can be raised on
    all only by a call that all make: `Contact`.
    """

    def __post_init__(self) -> None:
        if MPI.COMM_WORLD.size == 1:
            self.check()

    def check(self) -> None:
        """Raise `ContactError` for a value that cannot be used."""
