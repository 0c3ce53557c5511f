"""Checks of the arguments of shapes and bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checked import is_real_number, is_truth_value
from ..compat import Array
from ..errors import ContactError


def vector(name: str, value: Any, gdim: int | None = None) -> Array:
    """A finite vector of 2 or 3 components, padded with zeros to 3.

    Raises
    ------
    ContactError
        If it is not such a vector, or has not the given dimension.
    """
    try:
        given = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        given = np.empty(0)
    lengths = (2, 3) if gdim is None else (gdim,)
    if given.ndim != 1 or len(given) not in lengths or not np.isfinite(given).all():
        wanted = " or ".join(map(str, lengths))
        raise ContactError(f"{name} = {value!r} must be {wanted} finite numbers")
    return np.pad(given, (0, 3 - len(given)))


def direction(name: str, value: Any) -> Array:
    """A vector that is not zero, scaled to length 1."""
    given = vector(name, value)
    largest = float(np.abs(given).max())
    if largest == 0.0:
        raise ContactError(f"{name} is zero: it must have a direction")
    given = given / largest  # squares of components may overflow, or vanish
    return given / np.linalg.norm(given)


def positive(name: str, value: Any) -> float:
    """A positive number."""
    if not (is_real_number(value) and np.isfinite(value) and value > 0.0):
        raise ContactError(f"{name} = {value!r} must be a positive number")
    return float(value)


def truth(name: str, value: Any) -> bool:
    """True or False; any other type is an error."""
    if not is_truth_value(value):
        raise ContactError(f"{name} = {value!r} must be True or False")
    return bool(value)


def same_dimension(shape: str, vectors: Sequence[Any]) -> int:
    """Number of components of some vectors, which must be the same for all."""
    lengths = {len(v) for v in vectors}
    if len(lengths) > 1:
        raise ContactError(f"{shape} has vectors of different lengths")
    return int(lengths.pop())
