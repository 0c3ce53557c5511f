"""The user's forms: residual and tangent of everything but contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
from ufl.algorithms import expand_derivatives

from .. import compat
from ..compat import Array
from .linear_volume import Inputs, LinearVolume, has_condition_on


class Volume:
    """Residual and tangent of compiled forms, of all unknowns of a host. Collective.

    Parameters
    ----------
    contact
        Contact, or several.
    L, a
        Compiled residual and tangent, as lists where there are several unknowns.
    forms
        The same in UFL, if the tangent is the residual's derivative: where that does not
        depend on the unknowns it is assembled once, and the residual is a product
        with it. Else None.
    pattern
        Of the tangent, where it may be kept.
    """

    def __init__(
        self, contact: Any, L: Any, a: Any, forms: Any = None, pattern: Any = None
    ) -> None:
        self.contact, self.L, self.a = contact, L, a
        functions = contact.host.functions
        self._r = [compat.create_la_vector(*compat.unknowns_of(f)) for f in functions]
        self._linear = None
        if forms is not None:
            F, J = forms
            self._linear = self._kept(F, J, pattern)

    @property
    def is_linear(self) -> bool:
        """Whether the tangent is kept."""
        return self._linear is not None

    @property
    def kept(self) -> LinearVolume | None:
        """What is kept, as of the last residual or tangent."""
        return self._linear

    def _kept(self, F: Any, J: Any, pattern: Any) -> LinearVolume | None:
        """What is kept where the forms are linear."""
        functions = self.contact.host.functions
        forms = F if self.has_several else [F]
        table = J if self.has_several else [[J]]
        tangents = [
            expand_derivatives(one) for row in table for one in row if one is not None
        ]
        inputs = Inputs(forms, functions), Inputs(tangents, functions)
        jumps = has_condition_on(list(map(expand_derivatives, forms)), functions)
        if jumps or inputs[1].has_unknowns or inputs[0].share_memory_with(functions):
            return None
        return LinearVolume(self.contact, pattern, *inputs)

    @property
    def has_several(self) -> bool:
        """Whether there are forms for several unknowns."""
        return isinstance(self.L, list)

    def _table(self) -> tuple[list[Any], list[list[Any]]]:
        """Forms by unknown, and by test and trial space."""
        return (self.L, self.a) if self.has_several else ([self.L], [[self.a]])

    def with_form_of_u(self, L: Any, a: Any) -> tuple[Any, Any]:
        """L and a, with others in the place of those in the displacement's test
        function."""
        if not self.has_several:
            return L, a
        at = self.contact.host.only.at
        forms, table = list(self.L), list(map(list, self.a))
        forms[at], table[at][at] = L, a
        return forms, table

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Residual at the present state, of the owned unknowns. Collective."""
        kept = self._renewed(bcs)
        if kept is None:
            return self._assembled()
        return kept.forces(self.contact.host.owned_values())

    def _renewed(self, bcs: Sequence[Any]) -> LinearVolume | None:
        """What is kept, as it is for present conditions. Collective."""
        if self._linear is not None:
            fixed = self.contact.host.owned_prescribed(bcs)
            self._linear.renew(fixed, lambda A: self._assemble(A, ()), self._assembled)
        return self._linear

    def _assembled(
        self, bcs: Sequence[Any] = (), increment: Array | None = None
    ) -> Array:
        """The residual from its form, with the effect of prescribed increments if they
        are given. Collective."""
        host, rows, (L, a) = self.contact.host, [], self._table()
        conditions = host.conditions(bcs)
        for r, form, blocks, f in zip(self._r, L, a, host.functions):
            r.array[:] = 0.0
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
        host = self.contact.host
        parts = np.split(increment, host.starts[1:-1])
        for part, block, g, of_g in zip(parts, blocks, host.functions, conditions):
            # Takes the tangents of all cells with constrained dofs
            if block is not None and part.any():
                compat.apply_lifting(r, block, of_g, g.x.array, -1.0)

    def lifted(self, bcs: Sequence[Any], increment: Array) -> tuple[Array, Array]:
        """Residual with the effect of prescribed increments, of the owned unknowns: as
        it is, and with the conditions in their rows. Collective."""
        host = self.contact.host
        kept = self._renewed(bcs)
        if kept is None:
            volume = self._assembled(bcs, increment)
        else:
            volume = kept.forces(host.owned_values() + host.owned_part(increment))
        rows, starts = [], host.owned_starts
        conditions, parts = host.conditions(bcs), np.split(volume, starts[1:-1])
        for r, part, f, of_f in zip(self._r, parts, host.functions, conditions):
            r.array[: len(part)] = part
            compat.set_bc(r.array, of_f, f.x.array, -1.0)
            rows.append(r.array[: len(part)])
        return volume, np.concatenate(rows)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, with ones for constrained unknowns. Collective."""
        kept = self._renewed(bcs)
        if kept is None:
            self._assemble(A, bcs)
        else:
            kept.add_tangent(A)

    def _assemble(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        if not self.has_several:
            compat.assemble_jacobian(A, self.a, bcs)
            return
        fixed = self.contact.layout.begin + np.flatnonzero(
            self.contact.host.owned_prescribed(bcs)
        )
        starts = self.contact.host.starts
        compat.assemble_blocks(A, self.a, bcs, starts, fixed.astype(np.int32))
