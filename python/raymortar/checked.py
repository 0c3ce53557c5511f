"""Classes of options, checked where every rank can be told."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np


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


def are_same_objects(some: Sequence[Any], others: Sequence[Any]) -> bool:
    """Whether two sequences have the same objects in the same order."""
    return len(some) == len(others) and all(map(operator.is_, some, others))


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
