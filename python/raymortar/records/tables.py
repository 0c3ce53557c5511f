"""A file of numbered rows, which any number of ranks write and read together.

A mark, the length of a text, the text (JSON), and tables of doubles. Each rank writes the
rows that it has, wherever they are in their table, and reads those that it needs.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from ..arguments import writing
from ..core.compat import Array
from ..core.errors import ContactError, together

Rows = npt.NDArray[np.int64]

MARK = b"RAYMORT1"
# Of mark and length; tables begin at multiples of this, too
_STEP = 16
_DOUBLE = np.dtype("<f8")


@dataclass(frozen=True)
class Table:
    """Rows of a table that this rank has: their numbers (n,), and values (n, width).

    ``rows`` is how many all ranks have, each once.
    """

    name: str
    rows: int
    number: Rows
    values: Array


def as_list(values: Any) -> list[Any]:
    """Numbers as JSON has them, to the last digit."""
    return np.asarray(values).tolist()


def write_tables(
    comm: MPI.Comm, path: Path, head: dict[str, Any], tables: Sequence[Table]
) -> None:
    """Write a file, in place of an older one once it is whole. Collective."""
    found = [
        {"name": t.name, "rows": t.rows, "width": t.values.shape[1]} for t in tables
    ]
    text = json.dumps({**head, "tables": found}).encode()
    text += b" " * (-len(text) % _STEP)
    part, begin = path.with_name(path.name + ".part"), _STEP + len(text)
    ends = np.cumsum([begin, *(8 * t.rows * t.values.shape[1] for t in tables)])
    with writing(comm, path, OSError):
        if comm.rank == 0:
            with open(part, "wb") as file:
                file.write(MARK + len(text).to_bytes(8, "little") + text)
                file.truncate(int(ends[-1]))
    with writing(comm, path, OSError):
        with open(part, "r+b") as file:
            for start, table in zip(ends.tolist(), tables):
                order = np.argsort(table.number, kind="stable")
                number = table.number[order]
                values = np.ascontiguousarray(table.values[order], dtype=_DOUBLE)
                firsts = np.flatnonzero(np.diff(number, prepend=-2) != 1)
                each = zip(number[firsts].tolist(), np.split(values, firsts[1:]))
                for first, rows in each:
                    file.seek(start + 8 * first * values.shape[1])
                    file.write(rows.data)
    with writing(comm, path, OSError):
        if comm.rank == 0:
            os.replace(part, path)


def read_head(comm: MPI.Comm, path: Path) -> dict[str, Any]:
    """Read the text of a file on rank 0, for all. Collective."""
    head: dict[str, Any] = {}
    with together(comm):
        if comm.rank == 0:
            head = _checked_head(path)
    return comm.bcast(head, root=0)


def _checked_head(path: Path) -> dict[str, Any]:
    """Read the text of a file whose size is what its text says."""
    try:
        with open(path, "rb") as file:
            size = os.fstat(file.fileno()).st_size
            if file.read(len(MARK)) != MARK:
                raise ContactError(f"{path} is no checkpoint of raymortar")
            length = int.from_bytes(file.read(8), "little")
            head: dict[str, Any] = json.loads(file.read(min(length, size)))
            start = _STEP + length
            for table in head["tables"]:
                table["start"] = start
                start += 8 * table["rows"] * table["width"]
    except OSError as error:
        raise ContactError(f"{path} cannot be read: {error}") from None
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError):
        raise ContactError(f"{path} is cut short or damaged in its head") from None
    if start != size:
        raise ContactError(f"{path} is cut short: {size} bytes in place of {start}")
    return head


def read_tables(
    comm: MPI.Comm, path: Path, head: dict[str, Any], numbers: Sequence[Rows]
) -> list[Array]:
    """Read rows of each table by their numbers, (n, width) each. Collective.

    Ranks may read the same rows, and each row more than once.
    """
    found = []
    with together(comm):
        try:
            for table, number in zip(head["tables"], numbers):
                values = np.empty((0, table["width"]))
                if len(number) and table["width"]:
                    shape = table["rows"], table["width"]
                    values = np.memmap(path, _DOUBLE, "r", table["start"], shape)
                found.append(np.array(values[number]))
        except OSError as error:
            raise ContactError(f"{path} cannot be read: {error}") from None
    return found
