"""Compiled forms of the volume, assembled into arrays and matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import compat
from ..compat import Array


class VolumeForms:
    """Residual and tangent of compiled forms, of all unknowns of a host. Collective.

    Parameters
    ----------
    contact
        Contact, or several.
    L, a
        Compiled residual and tangent, as lists where there are several unknowns. In
        lists None is zero; an only tangent may be None too.
    """

    def __init__(self, contact: Any, L: Any, a: Any) -> None:
        self._contact, self.L, self.a = contact, L, a
        functions = contact.host.functions
        self._r = [compat.create_la_vector(*compat.unknowns_of(f)) for f in functions]

    @property
    def has_several(self) -> bool:
        """Whether there are forms for several unknowns."""
        return isinstance(self.L, list)

    def _table(self) -> tuple[list[Any], list[list[Any]]]:
        """Forms by unknown, and by test and trial space."""
        return (self.L, self.a) if self.has_several else ([self.L], [[self.a]])

    def residual(
        self, bcs: Sequence[Any] = (), increment: Array | None = None
    ) -> Array:
        """The residual of the owned unknowns, with the effect of prescribed increments
        if they are given. Collective."""
        host, rows, (L, a) = self._contact.host, [], self._table()
        conditions = host.conditions(bcs)
        for r, form, blocks, f in zip(self._r, L, a, host.functions):
            r.array[:] = 0.0
            if form is not None:
                compat.assemble_residual(r.array, form)
            if increment is not None:
                self._lift(r.array, blocks, conditions, increment)
            compat.scatter_reverse_add(r)
            index_map, bs = compat.unknowns_of(f)
            rows.append(r.array[: index_map.size_local * bs])
        return np.concatenate(rows)

    def _lift(
        self, r: Array, blocks: Sequence[Any], conditions: Any, increment: Array
    ) -> None:
        """Add the effect of prescribed increments to the residual of one test space,
        given the tangent's blocks in its rows and the conditions of each Function."""
        host = self._contact.host
        parts = np.split(increment, host.starts[1:-1])
        for part, block, g, of_g in zip(parts, blocks, host.functions, conditions):
            # Takes the tangents of all cells with constrained dofs
            if block is not None and part.any():
                compat.apply_lifting(r, block, of_g, g.x.array, -1.0)

    def with_conditions(self, residual: Array, bcs: Sequence[Any]) -> Array:
        """A residual of the owned unknowns, with what conditions lack in their rows.
        Collective."""
        rows, host = [], self._contact.host
        conditions = host.conditions(bcs)
        parts = np.split(residual, host.owned_starts[1:-1])
        for r, part, f, of_f in zip(self._r, parts, host.functions, conditions):
            r.array[: len(part)] = part
            compat.set_bc(r.array, of_f, f.x.array, -1.0)
            rows.append(r.array[: len(part)])
        return np.concatenate(rows)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, and set the diagonal of constrained unknowns to one.
        Collective."""
        if not self.has_several:
            if self.a is not None:
                compat.assemble_jacobian(A, self.a, bcs)
            return
        fixed = self._contact.layout.begin + np.flatnonzero(
            self._contact.host.owned_prescribed(bcs)
        )
        starts = self._contact.host.starts
        compat.assemble_blocks(A, self.a, bcs, starts, fixed.astype(np.int32))
