"""The fluxes of a problem: what they add to its residual and its tangent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function

from .. import _cpp
from ..core import compat
from ..core.compat import Array, Indices, Mask
from ..core.convergence.balance import EPS, Groups
from ..core.discretization.layout import CoupledRows
from ..core.discretization.ranks import destroy
from ..core.discretization.unknowns import Lacking, Unknowns
from ..core.errors import SetUpError, raise_everywhere, together
from ..core.gamma.probing import product
from ..core.terms import Addition, Term
from ..entries import Entries, add_entries, assembled, joined, values_at
from .flux_part import FluxPart
from .flux_sides import TiedField, find_fields
from .tool_part import ToolPart


class TiePart:
    """One tie of a field: its rows and those of its multiplier. Collective.

    Multipliers are divided by `scale` among the unknowns, and so are their rows
    multiplied: both are then like those of the field, and the matrix is symmetric
    [theory (7.6)].

    Attributes
    ----------
    functions
        Unknowns that the tie brings: the multiplier.
    scale
        Scale of the multiplier: the field's rows per area and unit of the field.
    stiffness
        Stiffness of the field at a slave node, and about of the multiplier's rows.
    """

    def __init__(
        self, sides: Sequence[TiedField], multiplier: Function, table: Indices
    ) -> None:
        self.sides, self.functions = list(sides), [multiplier]
        self.scale, self.stiffness = 1.0, 0.0
        self.is_solved_for = False
        self._comm: MPI.Comm = multiplier.function_space.mesh.comm
        ends = np.cumsum([len(side.slave.table) for side in self.sides])
        self._tables = np.split(table, ends[:-1])
        self._held: list[Mask] = []
        self._K: PETSc.Mat | None = None
        self._sizes: PETSc.Mat | None = None

    @property
    def name(self) -> str:
        """Name of the field, for messages."""
        return ", ".join(dict.fromkeys(side.slave.of.given.name for side in self.sides))

    def solve_for(
        self, unknowns: Unknowns, layout: CoupledRows, moves: bool = True
    ) -> None:
        """Take the rows of the field and of the multiplier. Collective."""
        self._unknowns, self._layout = unknowns, layout
        with together(self._comm):
            for side in self.sides:
                find_fields([side.slave.of, side.master.of], unknowns, "FieldTie")
        for side in self.sides:
            side.set_rows(layout.rows, unknowns.starts)
        (f,) = self.functions
        at = next(k for k, g in enumerate(unknowns.functions) if g is f)
        block = compat.element_info(f.function_space).block_size
        rows = layout.rows[unknowns.starts[at] : unknowns.starts[at + 1]]
        self._rows = [rows.reshape(-1, block)[table] for table in self._tables]
        self._K, self.is_solved_for = None, True

    @property
    def field_rows(self) -> Any:
        """Rows of the field on both sides, of this rank's facets."""
        found = [(side.slave_rows, side.own_master_rows) for side in self.sides]
        return np.concatenate([rows for pair in found for rows in pair])

    def choose_scale(self, stiffness: Callable[[Any], Array]) -> None:
        """Take a scale from the sums of the absolute entries of rows. Collective."""
        sums = np.zeros(2)
        for side in self.sides:
            sums[0] += stiffness(side.slave_rows).sum()
            sums[1] += side.fixed.weight.sum() * side.slave.width
        stiff, area = self._comm.allreduce(sums)
        self.scale = float(stiff / area) if stiff > 0.0 else 1.0
        count = self._comm.allreduce(sum(len(side.slave_rows) for side in self.sides))
        self.stiffness, self._K = float(stiff / count), None

    def rows(self, of_zone: Callable[[Any], int]) -> list[Any]:
        """Return no rows: `pattern` has all entries."""
        return []

    def prepare(self, look_up: Callable[[Any], Array]) -> None:
        """Make the matrix anew where other unknowns are prescribed. Collective."""
        held = [
            look_up(side.slave_rows).reshape(rows.shape) > 0.0
            for side, rows in zip(self.sides, self._rows)
        ]
        same = self._K is not None and all(map(np.array_equal, held, self._held))
        if self._comm.allreduce(int(not same)) == 0:
            return
        self._held = held
        free = sum(int(np.count_nonzero(~one)) for one in held)
        message = None
        if self._comm.allreduce(free) == 0:
            message = (
                f"the field {self.name} is prescribed on all slave nodes of a FieldTie, "
                "which leaves nothing to tie: swap slave and master"
            )
        raise_everywhere(self._comm, message, SetUpError)
        # The matrix and that of its absolute entries
        destroy(self._K, self._sizes)
        rows, columns, values = self._entries()
        self._K, self._sizes = (
            assembled(self._comm, self._layout.size, rows, columns, one)
            for one in (values, np.abs(values))
        )

    def _entries(self) -> Any:
        """Entries of the points and facets that are here. Collective."""
        found = [
            entries
            for number, side in enumerate(self.sides)
            for entries in (*self._of_points(number, side), self._of_held(number, side))
        ]
        return joined(found)

    def _of_points(self, number: int, side: TiedField) -> list[Entries]:
        """The jump in rows of the multiplier, the flux in those of the field."""
        fixed, lam = side.fixed, self._rows[number]
        block = lam.shape[-1]
        of_lam = lam[fixed.facet][:, :, None]  # (points, nodes, 1, components)
        all_rows = side.rows_at(fixed)
        points, width = all_rows.shape  # a rank may have no points
        of_field = all_rows.reshape(points, 1, width // block, block)
        weight = self.scale * fixed.weight
        each = np.einsum("q,qa,qb->qab", weight, fixed.N[0], fixed.jump)
        shape = (*each.shape, block)
        values = np.broadcast_to(each[..., None], shape).ravel()
        rows, columns = (np.broadcast_to(one, shape) for one in (of_lam, of_field))
        tests = np.broadcast_to(~self._held[number][fixed.facet][:, :, None], shape)
        return [
            (rows.ravel(), columns.ravel(), values * tests.ravel()),
            (columns.ravel(), rows.ravel(), values),
        ]

    def _of_held(self, number: int, side: TiedField) -> Entries:
        """Rows of multipliers where the field is prescribed: the mean of those next to
        them, so that a uniform flux stays one."""
        lam, fixed = self._rows[number], side.fixed
        area = np.bincount(fixed.facet, fixed.weight, len(lam))
        n = lam.shape[1]
        mean = n * np.eye(n) - 1.0
        held = self._held[number][:, :, None]
        values = self.scale * (area[:, None, None] * mean)[..., None] * held
        rows, columns = (
            np.broadcast_to(one, values.shape).ravel()
            for one in (lam[:, :, None], lam[:, None, :])
        )
        return rows, columns, values.ravel()

    # Equations

    def pattern(self) -> PETSc.Mat:
        """Matrix with all entries that there may be. Collective."""
        kept, self._held = self._held, [np.ones(r.shape, bool) for r in self._rows]
        entries = self._entries()
        self._held = kept
        return assembled(self._comm, self._layout.size, *entries)

    def residual(self) -> tuple[Any, Array]:
        """Rows and values of the residual that are here. Collective."""
        return self._own_rows, product(self._matrix, self._unknowns.owned_values())

    @property
    def _matrix(self) -> PETSc.Mat:
        assert self._K is not None
        return self._K

    @property
    def _own_rows(self) -> Any:
        return self._layout.begin + np.arange(self._layout.size)

    def tangent(self, largest: float) -> tuple[Entries, tuple[Any, Array, Array]]:
        """Rows, columns and values of the matrix that are here; and rows, sizes of their
        terms, and rounding errors. Collective."""
        offsets, columns, values = self._matrix.getValuesCSR()
        rows = np.repeat(self._own_rows, np.diff(offsets))
        assert self._sizes is not None
        terms = product(self._sizes, np.abs(self._unknowns.owned_values()))
        sizes = self._own_rows, terms, EPS * terms
        return (rows, columns.astype(np.int64), values), sizes

    def rate(self) -> Array:
        """Integrate the flux from the slaves to the masters, by component. Collective."""
        (f,) = self.functions
        block = compat.element_info(f.function_space).block_size
        total = np.zeros(block)
        for side, table in zip(self.sides, self._tables):
            nodal = f.x.array.reshape(-1, block)[table][side.fixed.facet]
            each = np.einsum("qa,qai->qi", side.fixed.N[0], nodal)
            total += side.fixed.weight @ each
        found: Array = self.scale * self._comm.allreduce(total)
        return found


Global = npt.NDArray[np.int64]
Part = FluxPart | TiePart | ToolPart


class FluxTerms(Term):
    """Fluxes through the contacts of one problem, and ties of its fields. Collective.

    Parameters
    ----------
    additions
        Fluxes and ties of fields.
    moves
        Whether bodies move: else pairs and points stay.
    """

    spoken = "fluxes"

    is_of_contact = True

    def __init__(self, additions: Sequence[Addition], moves: bool = True) -> None:
        of_terms = [one.part for one in additions]
        # Several fluxes may share the field of a tool
        tools = [one.tool for one in of_terms if getattr(one, "tool", None) is not None]
        self._parts: list[Part] = [*of_terms, *dict.fromkeys(tools)]
        found = {id(f): f for part in self._parts for f in part.functions}
        self.functions = list(found.values())
        self._moves = moves
        self._groups: Groups | None = None
        if any(isinstance(part, FluxPart) and part.feels_pressure for part in of_terms):
            # Halved steps only end nearer to the jump
            self.advice = (
                "a Flux may close contact by a jump, which a larger step passes"
            )

    def start(self, system: Any) -> None:
        """Take the system, whose unknowns include those that the parts bring."""
        self._system = system
        self._layout: CoupledRows = system.layout
        self._sum: PETSc.Vec = self._layout.create_vector()
        # Terms of the owned rows of the forms, and their rounding errors
        self._sizes = np.zeros((2, self._layout.n))
        for part in self._parts:
            part.solve_for(system.unknowns, self._layout, self._moves)
        # Owned unknowns on both sides of each tie
        self._tied = [
            self._added_up(part.field_rows, np.ones(len(part.field_rows))) > 0.0
            if isinstance(part, TiePart)
            else None
            for part in self._parts
        ]

    def choose_scales(self, sums: Array) -> None:
        """Scale multipliers as the fields' rows are, by the sums of their absolute
        entries. Collective."""
        for part in self._parts:
            part.choose_scale(lambda rows: self._at(sums, rows))

    def couple(self, pattern: Any) -> None:
        """Take scales and couplings from the volume, and make room in its pattern."""
        sums = np.zeros(self._layout.n)
        for field, row in zip(self._system.unknowns.fields(), pattern.couplings):
            sums[field.rows] = row[field.rows]
        self.choose_scales(sums)
        self._own_couplings(pattern.couplings)
        for part in self._parts:
            room = part.pattern()
            if room is not None:
                pattern.include(room)
                room.destroy()

    def set_groups(self, groups: Groups) -> None:
        """Take the groups of rows, and the largest position among the bodies."""
        self._groups = groups

    def _own_couplings(self, couplings: Array) -> None:
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

    def residual(self, bcs: Sequence[Any], lacking: Lacking) -> Array:
        """Residual of the owned unknowns of the forms, with the effect of prescribed
        increments. Collective."""
        self._prepare(lacking.fixed)
        rows, values = joined([part.residual() for part in self._parts])
        total = self._added_up(rows, values)
        increment = self._system.unknowns.owned_part(lacking.increment)
        if self._layout.comm.allreduce(int(increment.any())):
            entries = [part.tangent(0.0)[0] for part in self._parts]
            rows, columns, values = joined(entries)
            total += self._added_up(rows, values * self._at(increment, columns))
        return total

    def _added_up(self, rows: Global, values: Array) -> Array:
        """Sum up entries of a vector over the ranks, of the owned unknowns."""
        b = self._sum
        b.zeroEntries()
        b.setValues(rows.astype(PETSc.IntType), values, PETSc.InsertMode.ADD_VALUES)
        b.assemble()
        return b.getArray(readonly=True)[: self._layout.n].copy()

    def sizes(self) -> tuple[Array, Array]:
        """Add up by group what terms of the fields' rows had at the last tangent, and
        their rounding errors [theory (5.13)]. Collective."""
        assert self._groups is not None
        rows = np.zeros((2, len(self._groups.of_row)))
        rows[:, : self._layout.n] = self._sizes
        terms, errors = np.sqrt(self._groups.sum(*rows**2))
        return terms, errors

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, without constrained rows and columns. Collective."""
        largest = 0.0 if self._groups is None else self._groups.largest
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
