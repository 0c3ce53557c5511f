"""Entries of PETSc matrices as rows, columns and values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem.petsc import assemble_matrix
from scipy.sparse import block_diag, bsr_matrix, coo_array, csr_matrix

from . import _cpp
from .core.compat import Array
from .core.discretization.joined import Places
from .core.discretization.layout import CoupledRows
from .core.discretization.ranks import destroy

Entries = tuple[Any, Any, Array]

# Name under which a matrix carries its pattern
_PATTERN = "raymortar_pattern"


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


def empty_matrix(comm: MPI.Comm, rows: int, columns: int) -> PETSc.Mat:
    """Make a matrix, with so many rows and columns here, that takes entries anywhere."""
    A = PETSc.Mat().create(comm)
    A.setSizes(((rows, None), (columns, None)))
    A.setType(PETSc.Mat.Type.AIJ)
    A.setPreallocationNNZ((32, 32))
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    return A


def assembled(
    comm: MPI.Comm, size: int, rows: Any, columns: Any, values: Array
) -> PETSc.Mat:
    """Make a square matrix, with so many rows here, of entries in any rows. Collective."""
    A = empty_matrix(comm, size, size)
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


def copy_with_pattern(found: PETSc.Mat, A: PETSc.Mat) -> None:
    """Copy a matrix into another one, which gets its pattern where it has another, and
    then loses its attributes. Collective."""
    begin, columns, _ = found.getValuesCSR()
    # The matrix carries it: another one may later lie at the same address
    pattern = A.getAttr(_PATTERN)
    same = pattern is not None and all(map(np.array_equal, pattern, (begin, columns)))
    if not A.comm.tompi4py().allreduce(same, op=MPI.LAND):
        _cpp.set_pattern(A.handle, begin, columns)
        A.setAttr(_PATTERN, (begin, columns))
    found.copy(A, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)


def node_blocks(D: PETSc.Mat, at: Places) -> Array:
    """Take the entries of each node's own rows (nodes, m) in a matrix, (nodes, m, m),
    numbered from this rank's first row."""
    offsets, columns, values = D.getDiagonalBlock().getValuesCSR()
    own = csr_matrix((values, columns, offsets), (len(offsets) - 1,) * 2)
    rows, others = np.broadcast_arrays(at[:, :, None], at[:, None, :])
    found = np.zeros(rows.shape)
    if at.size:  # SciPy gives no array for no entries
        found[:] = np.asarray(own[rows.ravel(), others.ravel()]).reshape(rows.shape)
    return found


def block_diagonal(parts: Sequence[Array], comm: PETSc.Comm) -> PETSc.Mat:
    """Make a matrix of one block for each node of this rank, from one or several arrays
    (nodes, m, m). Collective."""
    each = []
    for blocks in parts:
        n, m, _ = blocks.shape
        diagonal = blocks, np.arange(n), np.arange(n + 1)
        each.append(bsr_matrix(diagonal, (n * m, n * m)))
    own = block_diag(each, "csr")
    size = own.shape[0]
    begin = comm.tompi4py().scan(size) - size
    csr = tuple(a.astype(PETSc.IntType) for a in (own.indptr, own.indices + begin))
    matrix = PETSc.Mat().createAIJ(((size, None),) * 2, csr=(*csr, own.data), comm=comm)
    matrix.assemble()
    return matrix


def values_at(vector: PETSc.Vec, rows: Any) -> Array:
    """Fetch a vector's blocks at rows, or blocks of rows, of any rank, (n, block size).
    Collective."""
    width = vector.getBlockSize()
    wanted, back = np.unique(rows, return_inverse=True)
    wanted = wanted.astype(PETSc.IntType)
    at = PETSc.IS().createBlock(width, wanted, comm=PETSc.COMM_SELF)
    here = PETSc.Vec().createSeq(width * len(wanted), bsize=width, comm=PETSc.COMM_SELF)
    scatter = PETSc.Scatter().create(vector, at, here, None)
    scatter.scatter(vector, here)
    found: Array = here.array_r.reshape(-1, width)[back.ravel()].copy()
    destroy(scatter, here, at)
    return found


def row_sums(a: Any, layout: CoupledRows) -> Array:
    """Sum the absolute entries of each owned row of the forms over its own Function.
    Collective."""
    table = a if isinstance(a, list) else [[a]]
    sizes = np.diff(layout.unknowns.owned_starts)
    found = []
    for k, n in enumerate(sizes):
        if table[k][k] is None:
            found.append(np.zeros(n))
            continue
        K = assemble_matrix(table[k][k])
        K.assemble()
        offsets, _, values = K.getValuesCSR()
        found.append(np.diff(np.append(0.0, np.cumsum(np.abs(values)))[offsets]))
        K.destroy()
    return np.concatenate(found)
