"""Checks of arguments, and classes of options that make them."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from .errors import ContactError

Vector = npt.NDArray[np.float64]


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


def vector(name: str, value: Any, gdim: int | None = None) -> Vector:
    """Check a finite vector of 2 or 3 components, and pad it with zeros to 3."""
    try:
        given = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        given = np.empty(0)
    lengths = (2, 3) if gdim is None else (gdim,)
    if given.ndim != 1 or len(given) not in lengths or not np.isfinite(given).all():
        wanted = " or ".join(map(str, lengths))
        raise ContactError(f"{name} = {value!r} must be {wanted} finite numbers")
    return np.pad(given, (0, 3 - len(given)))


def direction(name: str, value: Any) -> Vector:
    """Check a vector that is not zero, and scale it to length 1."""
    given = vector(name, value)
    largest = float(np.abs(given).max())
    if largest == 0.0:
        raise ContactError(f"{name} is zero: it must have a direction")
    given = given / largest  # squares of components may overflow, or vanish
    return given / np.linalg.norm(given)


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
