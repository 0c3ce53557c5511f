"""The field on rigid tools as an unknown: one number, with a capacity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array
from ..core.convergence.balance import EPS
from ..core.discretization.layout import CoupledRows
from ..core.discretization.unknowns import Unknowns
from ..core.errors import ContactError, is_real_number, require_agreement
from ..core.interface.zone_data import ZoneData
from ..core.system.assembly import ContactAssembly
from ..entries import assembled
from ..facet_functions import single_number
from .flux_sides import FieldOnZone


class ToolPart:
    """Balance of what rigid tools take up [theory (7.7)]. Collective.

    Fluxes add what flows into the tools; here is what these store.

    Attributes
    ----------
    functions
        Unknowns that it brings: the field on the tools.
    source
        Heat that flows in from elsewhere, per time.
    row
        Its row, on all ranks.
    old
        Field of the accepted step.
    """

    def __init__(self, comm: MPI.Comm, value: float, capacity: float) -> None:
        self._comm, self.capacity, self.source = comm, capacity, 0.0
        self._f: Function = single_number(comm, "field of the tool")
        self.functions = [self._f]
        self.row, self.stiffness, self.old = -1, 0.0, value
        self._met: list[tuple[ContactAssembly, FieldOnZone]] = []
        self.set(value)

    def meet(self, contact: ContactAssembly, sides: Sequence[FieldOnZone]) -> None:
        """Note a contact, whose slave surfaces with tools bring one more flux."""
        self._contact = contact
        self._met += [(contact, side) for side in sides if side.master is None]

    @property
    def value(self) -> float:
        """Present field on the tools. Collective."""
        here = self._f.x.array
        return float(self._comm.bcast(here[0] if len(here) else 0.0))

    def set(self, value: float) -> None:
        """Set the field on the tools."""
        self._f.x.array[:] = value

    def solve_for(
        self, unknowns: Unknowns, layout: CoupledRows, moves: bool = True
    ) -> None:
        """Take its row. Collective."""
        at = next(k for k, f in enumerate(unknowns.functions) if f is self._f)
        mine = layout.rows[unknowns.starts[at] : unknowns.starts[at + 1]]
        self.row = self._comm.bcast(int(mine[0]) if len(mine) else -1)
        self._layout, self._moves = layout, moves

    def choose_scale(self, stiffness: Callable[[Any], Array]) -> None:
        """Take the size of its row from those of the field's rows. Collective."""
        sums = [float(stiffness(side.slave_rows).sum()) for _, side in self._met]
        self.stiffness = self._comm.allreduce(sum(sums))

    def prepare(self, look_up: Callable[[Any], Array]) -> None:
        """Do nothing: prescribed unknowns change nothing."""

    def rows(self, of_zone: Callable[[Any], int]) -> list[Any]:
        """Return no rows: `pattern` has all entries."""
        return []

    def pattern(self) -> PETSc.Mat:
        """Matrix with all entries of its row and its column. Collective."""
        depends = [side.slave_rows for _, side in self._met]  # on the tools
        met = [np.array([self.row]), *depends]
        if self._moves:
            for contact, side in self._met:
                met += self._of_contact(contact, side.zone)
        columns, rows = (np.unique(np.concatenate(one)) for one in (met, depends))
        own = self.row
        first = np.concatenate([np.full(len(columns), own), rows])
        second = np.concatenate([columns, np.full(len(rows), own)])
        zeros = np.zeros(len(first))
        return assembled(self._comm, self._layout.size, first, second, zeros)

    def _of_contact(self, contact: ContactAssembly, zone: ZoneData) -> list[Any]:
        """Rows of displacement, multiplier and free bodies that a flux depends on."""
        found = [self._layout.u_rows[zone.facets.slave_surface.dofs].ravel()]
        if contact.layout.components:
            first = contact.layout.multiplier_rows[zone.multiplier_nodes]
            found.append(
                (first[:, None] + np.arange(contact.layout.components)).ravel()
            )
        of_bodies = self._layout.body_rows
        return found + [of_bodies[b] for b in zone.facets.bodies if b in of_bodies]

    @property
    def _rate(self) -> float:
        return self.capacity / self._contact.present.dt

    @property
    def _here(self) -> Any:
        """Its row where it is owned, (1,) or (0,)."""
        return np.array([self.row] if self._comm.rank == 0 else [], dtype=np.int64)

    def residual(self) -> tuple[Any, Array]:
        """Row and value of what is stored less what its source gives. Collective."""
        stored = self._rate * (self.value - self.old) - self.source
        return self._here, np.full(len(self._here), stored)

    def tangent(self, largest: float) -> tuple[Any, Any]:
        """Row, column and value; and row, size of its terms, rounding error."""
        here = self._here
        terms = self._rate * (abs(self.value) + abs(self.old)) + abs(self.source)
        sizes = here, np.full(len(here), terms), np.full(len(here), EPS * terms)
        return (here, here, np.full(len(here), self._rate)), sizes


class ToolField:
    """The field on rigid tools as an unknown, one number, with a capacity.

    The tools store the flux through contact and their share of the heat of friction, by
    the implicit Euler method: capacity times change over `Contact.dt`. Give it to
    `Flux`; several fluxes may share it, and then their tools have one value.

    Parameters
    ----------
    value
        At the start.
    capacity
        Heat that raises the value by one, >= 0: mass times specific heat. In 2D per
        thickness, for solids of revolution over a full turn. With 0 all that flows in
        flows out.
    source
        Heat that flows into the tools from elsewhere, per time. It may be set again.

    Examples
    --------
    >>> punch = raymortar.fluxes.ToolField(20.0, capacity=3.5)
    >>> flux = raymortar.fluxes.Flux(contact, T, law, tool=punch)
    >>> LoadSteps(solver, apply, steps, on_accept=punch.accept)
    """

    def __init__(self, value: float, capacity: float, source: float = 0.0) -> None:
        self._start = _number("value", value)
        self.capacity, self._source = _number("capacity", capacity), 0.0
        if self.capacity < 0.0:
            raise ContactError(
                f"ToolField.capacity = {capacity!r} must not be negative"
            )
        self._part: ToolPart | None = None
        self.source = source

    def __repr__(self) -> str:
        return f"<ToolField with a capacity of {self.capacity}>"

    def of(self, comm: MPI.Comm) -> ToolPart:
        """Make the unknown at the first call; return what stores it. Collective."""
        if self._part is None:
            require_agreement(
                comm, value=self._start, capacity=self.capacity, source=self._source
            )
            self._part = ToolPart(comm, self._start, self.capacity)
            self._part.source = self._source
        return self._part

    @property
    def _used(self) -> ToolPart:
        if self._part is None:
            raise ContactError("the ToolField is of no Flux yet: give it one, tool=")
        return self._part

    @property
    def value(self) -> float:
        """Present value. Collective."""
        return self._start if self._part is None else self._part.value

    @value.setter
    def value(self, value: float) -> None:
        self._start = _number("value", value)
        if self._part is not None:
            self._part.set(self._start)
            self._part.old = self._start

    @property
    def source(self) -> float:
        """Flux into the tools from elsewhere, per time."""
        return self._source

    @source.setter
    def source(self, source: float) -> None:
        self._source = _number("source", source)
        if self._part is not None:
            self._part.source = self._source

    @property
    def stored(self) -> float:
        """Heat that the tools have stored since the start, or since `value` was set.
        Collective."""
        return self.capacity * (self.value - self._start)

    def accept(self) -> None:
        """Accept the step: the next one starts from the present value. Collective."""
        self._used.old = self._used.value


def _number(name: str, value: Any) -> float:
    """Check a finite number."""
    if not (is_real_number(value) and np.isfinite(value)):
        raise ContactError(f"ToolField.{name} = {value!r} must be a finite number")
    return float(value)
