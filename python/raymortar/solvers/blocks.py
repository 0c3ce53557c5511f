"""Blocks of the coupled tangent, node by node."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from ..compat import Array


def index_sets(layout: Any) -> tuple[PETSc.IS, PETSc.IS]:
    """Owned rows of the displacement, and of all multipliers; those of free bodies,
    which follow, are in neither."""
    bs = layout.u.function_space.dofmap.index_map_bs
    sets = []
    of_bodies = sum(len(body.freedom) for body in layout.own_bodies)
    lengths = (0, layout.n, layout.size - of_bodies)
    ends = [layout.begin + length for length in lengths]
    for first, last, block in zip(ends, ends[1:], (bs, 1)):
        rows = np.arange(first, last, dtype=PETSc.IntType)
        one = PETSc.IS().createGeneral(rows, comm=layout.comm)
        one.setBlockSize(block)
        sets.append(one)
    return sets[0], sets[1]


def node_blocks(csr: Any, first: int, nodes: int, c: int, begin: int) -> Array:
    """Blocks on the diagonal of some rows, (nodes, c, c).

    Parameters
    ----------
    csr
        Compressed rows of this rank.
    first
        First of the rows, counted from the first row of this rank.
    nodes, c
        Number of nodes, and of components of each node.
    begin
        Column of this rank's first row.
    """
    offsets, columns, values = csr
    here = slice(offsets[first], offsets[first + nodes * c])
    rows = np.repeat(
        np.arange(nodes * c), np.diff(offsets[first : first + nodes * c + 1])
    )
    columns, values = columns[here] - begin - first, values[here]
    own = columns // c == rows // c
    rows, columns = rows[own], columns[own]
    blocks = np.zeros((nodes, c, c))
    blocks[rows // c, rows % c, columns % c] = values[own]
    return blocks


def block_diagonal(parts: list[tuple[int, Array]]) -> tuple[Array, Array, Array]:
    """Compressed rows of a matrix with blocks of several sizes.

    Parameters
    ----------
    parts
        First column and blocks (n, c, c) of each group of blocks of one size.
    """
    offsets, columns, values = [np.zeros(1, dtype=PETSc.IntType)], [], []
    for first, blocks in parts:
        n, c, _ = blocks.shape
        row = np.arange(n * c)
        ends = c * (1 + row) + offsets[-1][-1]
        offsets.append(ends.astype(PETSc.IntType))
        pattern = first + c * (row // c)[:, None] + np.arange(c)
        columns.append(pattern.ravel().astype(PETSc.IntType))
        values.append(blocks.ravel())
    return tuple(map(np.concatenate, (offsets, columns, values)))  # type: ignore[return-value]


def with_blocks(S: PETSc.Mat, bs: int) -> PETSc.Mat:
    """S with a block size, as products of matrices have none."""
    if S.getBlockSize() == bs:
        return S
    offsets, columns, values = S.getValuesCSR()
    n = len(offsets) - 1
    T = PETSc.Mat().create(S.comm)
    T.setSizes(((n, None), (n, None)), bsize=bs)
    T.setType(PETSc.Mat.Type.AIJ)
    T.setPreallocationCSR((offsets, columns, values))
    T.assemble()
    S.destroy()
    return T
