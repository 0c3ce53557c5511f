"""What contact adds to the stiffness of the bodies, as sparse blocks. On one rank."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from ..compat import Array

Places = npt.NDArray[np.int64]


class Coupling:
    """Entries that contact adds, in the rows and columns of its surfaces and of all
    unknowns that follow the host's.

    Parameters
    ----------
    added
        The tangent less the stiffness, in these rows and columns.
    n, last
        How many of them are of the surfaces, which come first, and of free rigid
        bodies, which come last.

    Attributes
    ----------
    touched
        Places of the surfaces that have entries.
    coupled, alone
        Places of the other unknowns, but for multipliers that have no entries with
        surfaces and rigid bodies, and places of these: contact is open there.
    """

    def __init__(self, added: PETSc.Mat, n: int, last: int = 0) -> None:
        offsets, columns, values = added.getValuesCSR()
        rows, there = rows_of(offsets), values != 0.0
        self._rows, self._columns = rows[there], columns[there].astype(np.int64)
        self._values, self._size = values[there], len(offsets) - 1
        places = np.arange(self._size)
        moves = (places < n) | (places >= self._size - last)
        used = np.zeros(self._size, dtype=bool)
        used[self._rows] = used[self._columns] = True
        self.touched = np.flatnonzero(used[:n])
        row_moves, column_moves = moves[self._rows], moves[self._columns]
        coupled = places >= max(n, self._size - last)
        coupled[self._columns[row_moves & ~column_moves]] = True
        coupled[self._rows[column_moves & ~row_moves]] = True
        self.coupled = np.flatnonzero(coupled)
        self.alone = n + np.flatnonzero(~coupled[n:])

    def block(self, rows: Places, columns: Places) -> PETSc.Mat:
        """Entries in some rows and columns, both in order, as a sparse matrix."""
        row, column = (np.full(self._size, -1) for _ in range(2))
        row[rows], column[columns] = np.arange(len(rows)), np.arange(len(columns))
        i, j = row[self._rows], column[self._columns]
        there = (i >= 0) & (j >= 0)
        counts = np.bincount(i[there], minlength=len(rows))
        offsets = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
        A = PETSc.Mat().createAIJ(
            (len(rows), len(columns)),
            csr=(offsets, j[there].astype(PETSc.IntType), self._values[there]),
            comm=PETSc.COMM_SELF,
        )
        A.assemble()
        return A


def rows_of(offsets: Places) -> Places:
    """Row of each entry of compressed rows."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def dense(A: PETSc.Mat) -> Array:
    """A sparse matrix as an array."""
    offsets, columns, values = A.getValuesCSR()
    full = np.zeros(A.getSize())
    full[rows_of(offsets), columns] = values
    return full


def times(A: PETSc.Mat, x: Array) -> Array:
    """A x of a sparse matrix and a vector, (n,), or several, (n, m)."""
    if not x.size:
        return np.zeros((A.getSize()[0], *x.shape[1:]))
    if x.ndim == 1:
        b, a = A.createVecs()
        b.array[:] = x
        A.mult(b, a)
        found = a.array.copy()
        things = [a, b]
    else:
        X = PETSc.Mat().createDense(
            x.shape, array=np.asfortranarray(x), comm=PETSc.COMM_SELF
        )
        X.assemble()
        product = A.matMult(X)
        found = product.getDenseArray().copy()
        things = [product, X]
    for thing in things:
        thing.destroy()
    return found
