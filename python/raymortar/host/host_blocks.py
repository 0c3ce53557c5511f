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


class PartOfMatrix:
    """Some rows and columns of a matrix, as a matrix.

    Parameters
    ----------
    parts
        Square matrices, for each the owned rows to take and their new places. They are
        the diagonal blocks.
    """

    def __init__(self, parts: Sequence[tuple[PETSc.Mat, Places, Places]]) -> None:
        self._parts = [(K, rows, at, *K.createVecs()) for K, rows, at in parts]
        self._comm = parts[0][0].comm
        self._size = sum(len(rows) for _, rows, _ in parts)

    def createVecs(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """A vector to multiply, and one for the product."""
        x, y = (
            PETSc.Vec().createMPI((self._size, None), comm=self._comm) for _ in range(2)
        )
        return x, y

    def mult(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = K x. Collective."""
        for K, rows, at, from_x, to_y in self._parts:
            from_x.set(0.0)
            from_x.array[rows] = x.array_r[at]
            K.mult(from_x, to_y)
            y.array[at] = to_y.array_r[rows]

    def getDiagonal(self) -> PETSc.Vec:
        """Diagonal entries."""
        diagonal, other = self.createVecs()
        other.destroy()
        for K, rows, at, *_ in self._parts:
            whole = K.getDiagonal()
            diagonal.array[at] = whole.array_r[rows]
            whole.destroy()
        return diagonal

    def destroy(self) -> None:
        """Free what belongs to it."""
        for *_, x, y in self._parts:
            x.destroy()
            y.destroy()


class HostBlocks:
    """Assembled blocks of a table of compiled forms. Collective.

    Parameters
    ----------
    form
        Compiled bilinear form, or a table of them by test and trial space.
    layout
        Rows of the coupled system.
    """

    def __init__(self, form: Any, layout: CoupledRows) -> None:
        self.layout, self.host = layout, layout.host
        table = form if isinstance(form, list) else [[form]]
        self.table = [[self._assembled(one) for one in row] for row in table]
        self._part: PartOfMatrix | None = None

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

    def of_displacement(self) -> Any:
        """Rows and columns of the displacement, in the order of its own space."""
        if self.host.is_plain:
            return self.table[0][0]
        parts = []
        for k, d in enumerate(self.host.displacements):
            n = d.size_owned
            K = self.table[d.at][d.at]
            parts.append((K, d.dofs[:n], self.host.u_places(k)[:n]))
        self._part = PartOfMatrix(parts)
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
