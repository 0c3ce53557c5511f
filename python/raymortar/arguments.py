"""Checks of arguments that floors have: vectors, and files to write."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from .core.errors import ContactError, together

Vector = npt.NDArray[np.float64]


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


def as_path(name: Any) -> Path:
    """Check the path of a file."""
    if not isinstance(name, (str, os.PathLike)):
        raise ContactError(f"the name of a file must be a path, not {name!r}")
    return Path(name)


def new_file(comm: MPI.Comm, name: Any) -> Path:
    """Check the path of a file that rank 0 will write."""
    path = as_path(name)
    if comm.rank == 0 and not path.parent.is_dir():
        raise ContactError(f"{path} cannot be written: there is no such folder")
    return path


@contextmanager
def writing(comm: MPI.Comm, path: Any, *kinds: type[Exception]) -> Iterator[None]:
    """Raise on all ranks errors of some kinds that keep one from writing. Collective."""
    with together(comm):
        try:
            yield
        except kinds as error:
            raise ContactError(f"{path} cannot be written: {error}") from None
