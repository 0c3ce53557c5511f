"""Blocks of the volume's matrix, from which contact reads pattern and stiffness
once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
from dolfinx.fem.petsc import assemble_matrix

from ..compat import Array, Indices
from .displacements import Places
from .host import Field
from .layout import CoupledRows


class HostBlocks:
    """Assembled blocks of a compiled form, or of a table of them. Collective."""

    def __init__(self, form: Any, layout: CoupledRows) -> None:
        self.layout, self.host = layout, layout.host
        table = form if isinstance(form, list) else [[form]]
        self.table = [[self._assembled(one) for one in row] for row in table]
        self._part: PETSc.Mat | None = None

    @staticmethod
    def _assembled(form: Any) -> PETSc.Mat | None:
        if form is None:
            return None
        K = assemble_matrix(form)
        K.assemble()
        return K

    def pattern(self) -> tuple[Indices, Indices]:
        """Compressed rows of the owned unknowns: offsets, and coupled columns."""
        rows, columns = [], []
        for start, blocks in zip(self.host.owned_starts, self.table):
            for k, K in enumerate(blocks):
                if K is None:
                    continue
                offsets, found, _ = K.getValuesCSR()
                columns.append(self.layout.coupled_columns(found, k))
                own = np.arange(len(offsets) - 1)
                rows.append(start + np.repeat(own, np.diff(offsets)))
        row, column = np.concatenate(rows), np.concatenate(columns)
        if len(rows) > 1:
            order = np.argsort(row, kind="stable")
            row, column = row[order], column[order]
        counts = np.bincount(row, minlength=self.layout.n)
        offsets = np.concatenate([[0], np.cumsum(counts)])
        return offsets.astype(np.int32), column

    def of_displacement(self) -> PETSc.Mat:
        """Rows and columns of the displacement, in the order of its own space."""
        if self.host.is_plain:
            return self.table[0][0]
        blocks = []
        for d in self.host.displacements:
            K: PETSc.Mat = self.table[d.at][d.at]
            rows = K.getOwnershipRange()[0] + d.dofs[: d.size_owned]
            places = PETSc.IS().createGeneral(rows.astype(PETSc.IntType), K.comm)
            blocks.append(K.createSubMatrix(places, places))
            places.destroy()
        # Owned dofs of several meshes follow each other, as rows of a nest do
        n = len(blocks)
        nest = [[K if i == j else None for j in range(n)] for i, K in enumerate(blocks)]
        whole = PETSc.Mat().createNest(nest, comm=blocks[0].comm)
        self._part = whole.convert("aij")
        for K in blocks:
            K.destroy()
        return self._part

    def couplings(self) -> Array:
        """Sums of the absolute entries of each owned row over the columns of each
        field, (fields, rows); see `Host.fields`. Collective."""
        fields = self.host.fields()
        if len(fields) == 1:
            return np.empty((0, 0))
        found = np.zeros((len(fields), self.layout.n))
        starts = self.host.owned_starts
        for blocks, begin, end in zip(self.table, starts, starts[1:]):
            for k, K in enumerate(blocks):
                if K is not None:
                    ends = starts[k], starts[k + 1]
                    found[:, begin:end] += _absolute_sums(K, fields, *ends)
        return found

    def destroy(self) -> None:
        """Free the matrices."""
        for K in (K for row in self.table for K in row if K is not None):
            K.destroy()
        if self._part is not None:
            self._part.destroy()


def _absolute_sums(K: PETSc.Mat, fields: list[Field], begin: int, end: int) -> Array:
    """For each field, sums over its columns among owned unknowns begin to end, (fields,
    rows of K)."""
    offsets, columns, values = K.getValuesCSR()
    rows = offsets, columns, abs(values)
    A = PETSc.Mat().createAIJ(K.getSizes(), csr=rows, comm=K.comm)
    x, y = A.createVecs()
    sums = []
    for field in fields:
        x.set(0.0)
        here = field.rows[(field.rows >= begin) & (field.rows < end)]
        x.array[here - begin] = 1.0
        A.mult(x, y)
        sums.append(y.array.copy())
    for thing in (A, x, y):
        thing.destroy()
    return np.array(sums)
