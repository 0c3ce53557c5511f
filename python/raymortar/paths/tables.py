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

from ..compat import Array
from ..errors import ContactError, raise_everywhere, together

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


def write_tables(
    comm: MPI.Intracomm, path: Path, head: dict[str, Any], tables: Sequence[Table]
) -> None:
    """Write a file, in place of an older one once it is whole. Collective.

    Raises
    ------
    ContactError
        If it cannot be written.
    """
    found = [
        {"name": t.name, "rows": t.rows, "width": t.values.shape[1]} for t in tables
    ]
    text = json.dumps({**head, "tables": found}).encode()
    text += b" " * (-len(text) % _STEP)
    part, fault = path.with_name(path.name + ".part"), _Fault(path, "written")
    with fault:
        file = MPI.File.Open(comm, str(part), MPI.MODE_WRONLY | MPI.MODE_CREATE)
    fault.tell(comm)
    start = _STEP + len(text)
    with fault:
        file.Set_size(start + sum(8 * t.rows * t.values.shape[1] for t in tables))
    with fault:
        if comm.rank == 0:
            length = np.array([len(text)], "<i8").tobytes()
            file.Write_at(0, MARK + length + text)
    for table in tables:
        order = np.argsort(table.number, kind="stable")
        values = np.ascontiguousarray(table.values[order], dtype=_DOUBLE)
        with _view(file, start, values.shape[1], table.number[order]), fault:
            file.Write_all(values)
        start += 8 * table.rows * values.shape[1]
    with fault:
        file.Close()
    with fault:
        if comm.rank == 0 and fault.text is None:
            os.replace(part, path)
    fault.tell(comm)


def read_head(comm: MPI.Comm, path: Path) -> dict[str, Any]:
    """Read the text of a file on rank 0, for all. Collective.

    Raises
    ------
    ContactError
        If there is no such file, or if it is of another kind or cut short.
    """
    head: dict[str, Any] = {}
    with together(comm):
        if comm.rank == 0:
            head = _checked_head(path)
    found: dict[str, Any] = comm.bcast(head, root=0)
    return found


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
    comm: MPI.Intracomm, path: Path, head: dict[str, Any], numbers: Sequence[Rows]
) -> list[Array]:
    """Read rows of each table by their numbers, (n, width) each. Collective.

    Ranks may read the same rows, and each row more than once.
    """
    fault, found = _Fault(path, "read"), []
    with fault:
        file = MPI.File.Open(comm, str(path), MPI.MODE_RDONLY)
    fault.tell(comm)
    for table, number in zip(head["tables"], numbers):
        unique, back = np.unique(number, return_inverse=True)
        values = np.empty((len(unique), table["width"]), dtype=_DOUBLE)
        with _view(file, table["start"], table["width"], unique), fault:
            file.Read_all(values)
        found.append(values[back.reshape(-1)])
    with fault:
        file.Close()
    fault.tell(comm)
    return found


class _Fault:
    """Keeps the first error of a file on this rank, so that ranks stay together."""

    def __init__(self, path: Path, what: str) -> None:
        self._begin = f"{path} cannot be {what}: "
        self.text: str | None = None

    def __enter__(self) -> _Fault:
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> bool:
        expected = isinstance(error, (MPI.Exception, OSError))
        if expected and self.text is None:
            self.text = f"{self._begin}{error}"
        return expected

    def tell(self, comm: MPI.Comm) -> None:
        """Raise on all ranks what any rank has met. Collective."""
        raise_everywhere(comm, self.text)


class _view:
    """Rows of a table as the part of a file that this rank sees. Collective."""

    def __init__(self, file: MPI.File, start: int, width: int, rows: Rows) -> None:
        self._row = MPI.DOUBLE.Create_contiguous(width).Commit()
        self._rows = self._row
        if len(rows):
            self._rows = self._row.Create_indexed_block(1, rows.tolist())
            self._rows.Commit()
        file.Set_view(start, self._row, self._rows)

    def __enter__(self) -> None:
        pass

    def __exit__(self, *error: Any) -> None:
        if self._rows is not self._row:
            self._rows.Free()
        self._row.Free()
