"""Rows of the nodes at which a law holds, in matrices and vectors of all ranks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy.sparse import csr_matrix

from ..core.compat import Array, Indices
from ..core.discretization.ranks import of_all


class RowsOfNodes:
    """Rows of some unknowns, and the columns in which a matrix has entries there.
    Collective.

    Attributes
    ----------
    all
        Global rows of all ranks, in their order.
    local
        Those that this rank owns, by its own numbers.
    """

    def __init__(self, rows: Sequence[Indices], A: PETSc.Mat) -> None:
        self._comm = A.comm.tompi4py()
        self._first, last = A.getOwnershipRange()
        # The owner of a node may have no facet around it
        self.all = np.unique(self._of_all(np.unique(_joined(rows))))
        mine = self.all[(self.all >= self._first) & (self.all < last)]
        self.local: Indices = mine - self._first
        self._own = self.places(mine)
        met = [A.getRow(row)[0] for row in mine]
        self._columns = np.unique(self._of_all(np.unique(_joined([mine, *met]))))
        self._offsets = np.cumsum([0, *map(len, met)])
        self._places = np.searchsorted(self._columns, _joined(met))
        own = (self._columns >= self._first) & (self._columns < last)
        self._own_columns = self._columns[own] - self._first
        self._in_columns = np.searchsorted(self._columns, self.all)

    def entries(self, A: PETSc.Mat) -> Array:
        """Entries of this rank's rows of a matrix, row by row."""
        rows = self.local + self._first
        return np.concatenate([*(A.getRow(row)[1] for row in rows), np.empty(0)])

    def matrix(self, entries: Array) -> csr_matrix:
        """This rank's rows with some entries, by the columns."""
        shape = len(self.local), len(self._columns)
        return csr_matrix((entries, self._places, self._offsets), shape=shape)

    def row_of_entries(self) -> Indices:
        """Row of each entry, numbered among this rank's."""
        return np.repeat(np.arange(len(self.local)), np.diff(self._offsets))

    def largest(self, entries: Array) -> Array:
        """Largest entry of each of this rank's rows; they have a diagonal."""
        if not len(self.local):
            return np.empty(0)
        return np.asarray(np.maximum.reduceat(abs(entries), self._offsets[:-1]))

    def in_columns(self, values: Array) -> Array:
        """Values in all columns, from those of this rank's unknowns. Collective."""
        return np.asarray(self._of_all(values[self._own_columns]))

    def of_columns(self, values: Array) -> Array:
        """Values in all rows, from those in all columns."""
        return np.asarray(values[self._in_columns])

    def joined(self, values: Any) -> Array:
        """Values in all rows, from those in this rank's. Collective."""
        return np.asarray(self._of_all(values))

    def places(self, rows: Indices) -> Indices:
        """Places of some rows among all."""
        return np.asarray(np.searchsorted(self.all, rows))

    def spread(self, rows: Indices, values: Array) -> Array:
        """Values in all rows, from those in some that each rank knows. Collective."""
        places, known = self._of_all(self.places(rows)), self._of_all(values)
        found = np.zeros(len(self.all), known.dtype)
        found[places] = known
        return found

    def own(self, values: Any) -> Any:
        """Values in this rank's rows, from those in all."""
        return values[self._own]

    def _of_all(self, values: Any) -> Any:
        """Join the values of all ranks, whose unknowns are in the order of ranks."""
        if self._comm.size == 1:
            return values
        (found,) = of_all(self._comm, values)
        return found


def _joined(numbers: Sequence[Indices]) -> Indices:
    """Join arrays of whole numbers."""
    found: Indices = np.concatenate([*map(np.ravel, numbers), np.empty(0, np.int64)])
    return found.astype(np.int64)
