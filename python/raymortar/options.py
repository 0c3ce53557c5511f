"""Classes of options, checked where every rank can be told."""

from __future__ import annotations

from typing import Any

import numpy as np

from mpi4py import MPI


def is_real_number(value: Any) -> bool:
    """Whether a value is one real number, finite or not."""
    return isinstance(value, (int, float, np.number)) and bool(np.isreal(value))


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
