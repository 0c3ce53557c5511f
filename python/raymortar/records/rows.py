"""Records of a history: their numbers, and those of an earlier file."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.errors import ContactError


def numbers(row: Mapping[str, Any]) -> dict[str, float]:
    """Convert the values of a record."""
    for name, value in row.items():
        try:
            float(value)
        except (TypeError, ValueError):
            message = f"{name} of a record must be a number, not {value!r}"
            raise ContactError(message) from None
    return {name: float(value) for name, value in row.items()}


def checked(rows: Any, count: int) -> list[list[float]]:
    """Check that records are numbers, one for each of some columns."""
    try:
        found = [[float(value) for value in row] for row in rows]
    except (TypeError, ValueError):
        message = f"rows must be records, as of History.rows, not {rows!r}"
        raise ContactError(message) from None
    for i, row in enumerate(found):
        if len(row) != count:
            message = f"record {i} has {len(row)} values, this history {count} columns"
            raise ContactError(message)
    return found


def read_records(path: Path | None, columns: Sequence[str]) -> list[list[float]]:
    """Read the complete records of a file with these columns."""
    if path is None:
        raise ContactError("a history without a file has none to go on from")
    try:
        text = path.read_text(encoding="utf-8")
        # The line that a killed run was writing has no end
        head, *lines = csv.reader(text.split("\n")[:-1])
        rows = [[float(x) for x in values] for values in lines]
    except (OSError, ValueError) as error:
        raise ContactError(f"{path} cannot be read: {error}") from None
    if tuple(head) != tuple(columns):
        raise ContactError(f"{path} has other columns than this history")
    return checked(rows, len(columns))


def present_name(column: str, columns: Sequence[str], former: Mapping[str, str]) -> str:
    """Name of a column, which may be asked for by the one that it had beside it: then
    `former` has the label that is in the name now."""
    if column in columns:
        return column
    for other, label in former.items():
        name = re.sub(f"_{other}(?=_[xyz]$|$)", f"_{label}", str(column))
        if name in columns:
            text = f"the column {column!r} of a history is now {name!r}"
            warnings.warn(text, DeprecationWarning, stacklevel=3)
            return name
    listed = ", ".join(columns)
    raise ContactError(f"a history has no column {column!r}, but {listed}")
