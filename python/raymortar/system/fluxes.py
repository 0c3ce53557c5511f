"""The fluxes of a problem: what they add to its residual and its tangent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from .. import _cpp
from ..compat import Array
from ..convergence.balance import Groups
from ..discretization.layout import CoupledRows
from ..discretization.unknowns import Lacking
from .flux_part import FluxPart, joined

Global = npt.NDArray[np.int64]


class FluxTerms:
    """Fluxes between the sides of the contacts of one problem. Collective.

    Parameters
    ----------
    system
        Contact or several.
    parts
        The fluxes.
    """

    def __init__(self, system: Any, parts: Sequence[FluxPart]) -> None:
        self._system, self._parts = system, list(parts)
        self._layout: CoupledRows = system.layout
        self._sum: PETSc.Vec = self._layout.create_vector()
        # Terms of the owned rows of the forms, and their rounding errors
        self._sizes = np.zeros((2, self._layout.n))
        functions = system.unknowns.functions
        for part in self._parts:
            part.solve_for(functions, self._layout)

    def rows(self) -> list[_cpp.FieldRows]:
        """Rows of the fields on the zones' facets, for the room of a matrix."""
        numbers = {id(zone): k for k, zone in enumerate(self._system.zones)}
        return [
            side.pattern(numbers[id(side.zone)])
            for part in self._parts
            for side in part.sides
        ]

    def residual(self, lacking: Lacking) -> Array:
        """Residual of the owned unknowns of the forms, with the effect of prescribed
        increments. Collective."""
        rows, values = joined([part.residual() for part in self._parts])
        total = self._added_up(rows, values)
        increment = self._system.unknowns.owned_part(lacking.increment)
        if self._layout.comm.allreduce(int(increment.any())):
            total += self._lifted(increment)
        return total

    def _added_up(self, rows: Global, values: Array) -> Array:
        """Sum up entries of a vector over the ranks, of the owned unknowns."""
        b = self._sum
        b.zeroEntries()
        b.setValues(rows.astype(PETSc.IntType), values, PETSc.InsertMode.ADD_VALUES)
        b.assemble()
        found: Array = b.getArray(readonly=True)[: self._layout.n].copy()
        return found

    def _lifted(self, increment: Array) -> Array:
        """Effect of prescribed increments on the other rows."""
        entries = [part.tangent(0.0)[0] for part in self._parts]
        rows, columns, values = joined(entries)
        return self._added_up(rows, values * self._at(increment, columns))

    def sizes(self, groups: Groups) -> tuple[Array, Array]:
        """Add up by group what terms of the fields' rows had at the last tangent, and
        their rounding errors [theory (5.13)]. Collective."""
        rows = np.zeros((2, len(groups.of_row)))
        rows[:, : self._layout.n] = self._sizes
        terms, errors = np.sqrt(groups.sum(*rows**2))
        return terms, errors

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any], largest: float) -> None:
        """Add the tangent, without constrained rows and columns. Positions are as large
        as `largest`. Collective."""
        entries, sizes = zip(*(part.tangent(largest) for part in self._parts))
        rows, columns, values = joined(entries)
        at, *found = joined(sizes)
        self._sizes = np.array([self._added_up(at, one) for one in found])
        fixed = self._system.unknowns.owned_prescribed(bcs).astype(np.float64)
        free = (self._at(fixed, rows) == 0.0) & (self._at(fixed, columns) == 0.0)
        *csr, numbers = _runs(rows[free], columns[free], values[free])
        A.setValuesIJV(*csr, addv=PETSc.InsertMode.ADD_VALUES, rowmap=numbers)

    def _at(self, owned: Array, rows: Global) -> Array:
        """Values of the owned unknowns of the forms at rows of any rank; 0 at others."""
        layout = self._layout
        full = np.zeros(layout.size)
        full[: layout.n] = owned
        if layout.comm.size == 1:
            found: Array = full[rows]
            return found
        wanted, inverse = np.unique(rows, return_inverse=True)
        source = layout.create_vector()
        source.setArray(full)
        index = PETSc.IS().createGeneral(
            wanted.astype(PETSc.IntType), comm=PETSc.COMM_SELF
        )
        target = PETSc.Vec().createSeq(len(wanted), comm=PETSc.COMM_SELF)
        scatter = PETSc.Scatter().create(source, index, target, None)
        scatter.scatter(source, target)
        values: Array = target.getArray().copy()[inverse]
        for thing in (scatter, target, index, source):
            thing.destroy()
        return values


def _runs(rows: Global, columns: Global, values: Array) -> tuple[Any, Any, Any, Any]:
    """Divide entries where the row changes: offsets, columns, values, row of each run."""
    first = np.flatnonzero(np.diff(rows, prepend=-1))
    kind = PETSc.IntType
    offsets = np.append(first, len(rows)).astype(kind)
    return offsets, columns.astype(kind), values, rows[first].astype(kind)
