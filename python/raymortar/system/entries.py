"""Entries of PETSc matrices as rows, columns and values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from scipy.sparse import coo_array

from ..compat import Array
from ..discretization.layout import CoupledRows

Entries = tuple[Any, Any, Array]


def joined(parts: Sequence[tuple[Any, ...]]) -> Any:
    """Join the first arrays of all parts, then the second ones, and so on."""
    return tuple(np.concatenate(arrays) for arrays in zip(*parts))


def summed(rows: Any, columns: Any, values: Array) -> Entries:
    """Add up entries of the same place, and sort them by row."""
    local, at = np.unique(np.append(rows, columns), return_inverse=True)
    at = at.ravel()[: len(rows)], at.ravel()[len(rows) :]
    K = coo_array((values, at), (len(local),) * 2).tocsr().tocoo()
    return local[K.row], local[K.col], K.data


def add_entries(A: PETSc.Mat, rows: Any, columns: Any, values: Array) -> None:
    """Add entries to a matrix, which the caller assembles. Collective."""
    first, kind = np.flatnonzero(np.diff(rows, prepend=-1)), PETSc.IntType
    offsets = np.append(first, len(rows)).astype(kind)
    csr = offsets, columns.astype(kind), values
    add = PETSc.InsertMode.ADD_VALUES
    A.setValuesIJV(*csr, addv=add, rowmap=rows[first].astype(kind))


def assembled(
    comm: MPI.Comm, size: int, rows: Any, columns: Any, values: Array
) -> PETSc.Mat:
    """Make a square matrix, with so many rows here, of entries in any rows. Collective."""
    A = PETSc.Mat().create(comm)
    A.setSizes(((size, None),) * 2)
    A.setType(PETSc.Mat.Type.AIJ)
    A.setPreallocationNNZ((32, 32))
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    add_entries(A, *summed(rows, columns, values))
    A.assemble()
    return A


def in_own_rows(
    layout: CoupledRows, rows: Any, columns: Any, values: Array
) -> PETSc.Mat:
    """Make a matrix over the coupled rows, of entries in this rank's. Collective."""
    order, kind = np.lexsort((columns, rows)), PETSc.IntType
    counts = np.bincount(rows - layout.begin, minlength=layout.size)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(kind)
    csr = offsets, columns[order].astype(kind), values[order]
    A = PETSc.Mat().createAIJ(((layout.size, None),) * 2, csr=csr, comm=layout.comm)
    A.assemble()
    return A


def without_zeros(K: PETSc.Mat) -> PETSc.Mat:
    """Copy the entries of a matrix that are not zero."""
    offsets, columns, values = K.getValuesCSR()
    found = values != 0.0
    before = np.concatenate([[0], np.cumsum(found)])
    rows = before[offsets].astype(PETSc.IntType), columns[found], values[found]
    A = PETSc.Mat().createAIJ(K.getSizes(), csr=rows, comm=K.comm)
    A.assemble()
    return A
