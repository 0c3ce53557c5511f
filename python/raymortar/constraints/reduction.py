"""Linear constraints between unknowns: masters in place of slaves, T^T r and T^T A T."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..core.discretization.ranks import destroy
from ..core.errors import SetUpError, raise_everywhere
from ..core.system.coupled import ROOM, CoupledSystem
from ..entries import copy_with_pattern, in_own_rows, values_at
from .multipliers import mirrored_multipliers
from .prolongation import Slaves, slaves_of

_Structure = PETSc.Mat.Structure


class Constraints:
    """Unknowns that are combinations of others, x = T x [theory (5.24)]. Collective.

    Everything is evaluated at T x. With T_r, which is T without the masters that
    conditions prescribe, the equations are T_r^T r(T x) = 0 and, in the rows of slaves,
    x - T x = 0. Their derivative has the blocks T_r^T A T and 1 - T.

    Attributes
    ----------
    own
        Owned rows of slaves, numbered from the first row of this rank.
    inner
        The tangent A of all unknowns.
    """

    def __init__(self, given: Any, system: CoupledSystem, bcs: Sequence[Any]) -> None:
        self._layout = layout = system.layout
        slaves = slaves_of(given, system)
        slaves = slaves.joined(mirrored_multipliers(system, slaves, bcs))
        self._refuse(slaves, system.unknowns.owned_prescribed(bcs))
        self.own = np.unique(slaves.rows - layout.begin)
        is_slave = np.zeros(layout.size, dtype=bool)
        is_slave[self.own] = True
        others = layout.begin + np.flatnonzero(~is_slave)
        rows = np.concatenate([others, slaves.rows])
        columns = np.concatenate([others, slaves.masters])
        values = np.concatenate([np.ones(len(others)), slaves.values])
        fixed = self._marked(system.unknowns.owned_prescribed(bcs), columns)
        kept = ~fixed | (rows == columns)
        self._T = in_own_rows(layout, rows, columns, values)
        self._Tr = in_own_rows(layout, rows[kept], columns[kept], values[kept])
        mine = layout.begin + self.own
        self._of_slaves = in_own_rows(
            layout,
            np.concatenate([mine, slaves.rows]),
            np.concatenate([mine, slaves.masters]),
            np.concatenate([np.ones(len(mine)), -slaves.values]),
        )
        self._x, self._b = layout.create_vector(), layout.create_vector()
        self._lacking = np.zeros(len(self.own))
        self.inner: PETSc.Mat | None = None

    def _marked(self, owned: Any, rows: Any) -> Any:
        """Whether rows of any rank are among marked ones, (owned rows,) or fewer.
        Collective."""
        marks = self._layout.create_vector()
        marks.array[: len(owned)] = owned
        found = values_at(marks, rows).ravel() > 0.0
        marks.destroy()
        return found

    def _refuse(self, slaves: Slaves, prescribed: Any) -> None:
        """Raise for slaves that are prescribed, or masters of others. Collective."""
        is_slave = np.zeros(self._layout.size)
        is_slave[slaves.rows - self._layout.begin] = 1.0
        fixed = self._marked(prescribed, slaves.rows)
        chained = self._marked(is_slave, slaves.masters)
        message = None
        if fixed.any():
            message = "constraints has slaves that bcs prescribe: leave them out of one of both"
        elif chained.any():
            message = "constraints has masters that are slaves: give each free masters"
        raise_everywhere(self._layout.comm, message, SetUpError)

    def applied(self, x: PETSc.Vec) -> PETSc.Vec:
        """T x. It is overwritten by the next call. Collective."""
        self._T.mult(x, self._x)
        self._lacking = x.array_r[self.own] - self._x.array_r[self.own]
        return self._x

    def apply(self, x: PETSc.Vec) -> None:
        """Let x meet the constraints. Collective."""
        self.applied(x).copy(x)

    def reduce(self, b: PETSc.Vec) -> None:
        """Reduce a residual at the last x of `applied`. Collective."""
        self._Tr.multTranspose(b, self._b)
        self._b.array[self.own] = self._lacking
        self._b.copy(b)

    def create_matrix(self, inner: PETSc.Mat) -> PETSc.Mat:
        """Matrix of the reduced equations, given that of all unknowns. Collective."""
        self.inner = inner
        inner.assemble()
        A = self._product()
        A.zeroEntries()
        A.setAttr(ROOM, inner.getAttr(ROOM))
        return A

    def _product(self) -> PETSc.Mat:
        """T_r^T A T. Collective."""
        assert self.inner is not None
        half = self._Tr.transposeMatMult(self.inner)
        found = half.matMult(self._T)
        destroy(half)
        return found

    def fill(self, A: PETSc.Mat) -> None:
        """Set the reduced tangent, which gets the pattern of the product where it has
        another. Collective."""
        assert self.inner is not None
        product = self._product()
        product.axpy(1.0, self._of_slaves, _Structure.DIFFERENT_NONZERO_PATTERN)
        copy_with_pattern(product, A)
        A.setAttr(ROOM, self.inner.getAttr(ROOM))
        destroy(product)
