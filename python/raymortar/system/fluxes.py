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
from .entries import add_entries, joined, values_at
from .field_tie import TiePart
from .flux_part import FluxPart
from .tool_part import ToolPart

Global = npt.NDArray[np.int64]
Part = FluxPart | TiePart | ToolPart


class FluxTerms:
    """Fluxes through the contacts of one problem, and ties of its fields. Collective."""

    def __init__(self, system: Any, parts: Sequence[Part], moves: bool = True) -> None:
        self._system, self._parts = system, list(parts)
        self._layout: CoupledRows = system.layout
        self._sum: PETSc.Vec = self._layout.create_vector()
        # Terms of the owned rows of the forms, and their rounding errors
        self._sizes = np.zeros((2, self._layout.n))
        for part in self._parts:
            part.solve_for(system.unknowns, self._layout, moves)
        # Owned unknowns on both sides of each tie
        self._tied = [
            self._marked(part.field_rows) if isinstance(part, TiePart) else None
            for part in self._parts
        ]

    def _marked(self, rows: Global) -> Any:
        """Whether owned unknowns are among rows of any rank. Collective."""
        return self._added_up(rows, np.ones(len(rows))) > 0.0

    def choose_scales(self, sums: Array) -> None:
        """Scale multipliers as the fields' rows are, by the sums of their absolute
        entries. Collective."""
        for part in self._parts:
            part.choose_scale(lambda rows: self._at(sums, rows))

    def own_couplings(self, couplings: Array) -> None:
        """Set how rows of unknowns that the parts bring depend on them, (fields, rows),
        for line searches and rounding errors."""
        stiffness = {id(f): one.stiffness for one in self._parts for f in one.functions}
        unknowns = self._system.unknowns
        ends = zip(unknowns.owned_starts, unknowns.owned_starts[1:])
        of_rows = [stiffness.get(id(f), 0.0) for f in unknowns.functions]
        for value, (begin, end) in zip(of_rows, ends):
            for field, row in zip(unknowns.fields(), couplings):
                own = field.rows[(field.rows >= begin) & (field.rows < end)]
                row[own] += value

    def patterns(self) -> list[PETSc.Mat]:
        """Matrices that the tangent needs room for, beside `rows`. Collective."""
        found = [part.pattern() for part in self._parts]
        return [one for one in found if one is not None]

    def rows(self) -> list[_cpp.FieldRows]:
        """Rows of the fields on the zones' facets, for the room of a matrix."""
        numbers = {id(zone): k for k, zone in enumerate(self._system.zones)}
        return [
            rows
            for part in self._parts
            for rows in part.rows(lambda zone: numbers[id(zone)])
        ]

    def _prepare(self, fixed: Any) -> None:
        """Tell the parts which owned unknowns are prescribed, by conditions or, where
        surfaces meet, by the ties before."""
        marks = np.array(fixed, dtype=np.float64)
        for part, tied in zip(self._parts, self._tied):
            part.prepare(lambda rows: self._at(marks, rows))
            if tied is not None:
                marks[tied] = 1.0

    def residual(self, lacking: Lacking) -> Array:
        """Residual of the owned unknowns of the forms, with the effect of prescribed
        increments. Collective."""
        self._prepare(lacking.fixed)
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
        return b.getArray(readonly=True)[: self._layout.n].copy()

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
        fixed = self._system.unknowns.owned_prescribed(bcs).astype(np.float64)
        self._prepare(fixed)
        entries, sizes = zip(*(part.tangent(largest) for part in self._parts))
        rows, columns, values = joined(entries)
        at, *found = joined(sizes)
        self._sizes = np.array([self._added_up(at, one) for one in found])
        free = (self._at(fixed, rows) == 0.0) & (self._at(fixed, columns) == 0.0)
        add_entries(A, rows[free], columns[free], values[free])

    def _at(self, owned: Array, rows: Global) -> Array:
        """Values of the owned unknowns of the forms at rows of any rank; 0 at others."""
        layout = self._layout
        full = np.zeros(layout.size)
        full[: layout.n] = owned
        if layout.comm.size == 1:
            return full[rows]
        source = layout.create_vector()
        source.setArray(full)
        found = values_at(source, rows).ravel()
        source.destroy()
        return found


def own_functions(parts: Sequence[Part]) -> list[Any]:
    """Unknowns that the parts bring, each once."""
    found = {id(f): f for part in parts for f in part.functions}
    return list(found.values())


def extended(F: Any, J: Any, count: int) -> tuple[Any, Any]:
    """Forms and their derivatives as lists, with none for further unknowns."""
    forms = list(F) if isinstance(F, (list, tuple)) else [F]
    table = [list(row) for row in J] if isinstance(F, (list, tuple)) else [[J]]
    none = [None] * count
    rows = [row + none for row in table]
    return forms + none, rows + [[None] * (len(forms) + count) for _ in none]
