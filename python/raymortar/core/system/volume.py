"""The user's forms: residual and tangent of everything but contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from .. import compat
from ..compat import Array, Mask
from ..discretization.unknowns import Unknowns
from ..errors import together
from ..hooks import hooks


class Forms:
    """Assembles compiled forms of all unknowns of the forms. Collective.

    Forms of several unknowns are lists, in which None is zero. An only tangent may be
    None too.
    """

    def __init__(self, contact: Any, L: Any, a: Any) -> None:
        self._contact, self._unknowns = contact, contact.unknowns
        self.has_several = isinstance(L, list)
        self._a = a
        maps = [compat.unknowns_of(f) for f in self._unknowns.functions]
        vectors = [compat.create_la_vector(*one) for one in maps]
        forms, table = (L, a) if self.has_several else ([L], [[a]])
        # By test space, with views of arrays and of their owned parts
        starts = self._unknowns.owned_starts
        self._found = np.zeros(starts[-1])
        owned = np.split(self._found, starts[1:-1])
        self._rows = [
            (form, blocks, r, r.array, part)
            for form, blocks, r, part in zip(forms, table, vectors, owned)
        ]
        self._alone = self._unknowns.comm.size == 1

    def residual(
        self, bcs: Sequence[Any] = (), increment: Array | None = None
    ) -> Array:
        """Assemble the owned rows, with the effect of prescribed increments if given."""
        lifts = increment is not None and len(increment.nonzero()[0]) > 0
        for form, blocks, r, array, owned in self._rows:
            array[:] = 0.0
            if form is not None:
                compat.assemble_residual(array, form)
            if lifts:
                self._lift(array, blocks, bcs, increment)
            if not self._alone:
                compat.scatter_reverse_add(r)
            owned[:] = array[: len(owned)]
        return self._found.copy()

    def _lift(
        self, r: Array, blocks: Sequence[Any], bcs: Sequence[Any], increment: Any
    ) -> None:
        """Add the effect of prescribed increments to the rows of one test space."""
        unknowns = self._unknowns
        parts = np.split(increment, unknowns.starts[1:-1])
        each = zip(parts, blocks, unknowns.functions, unknowns.conditions(bcs))
        for part, block, f, of_f in each:
            # Takes the tangents of all cells with constrained dofs
            if block is not None and part.any():
                compat.apply_lifting(r, block, of_f, f.x.array, -1.0)

    def add_tangent(
        self, A: PETSc.Mat, bcs: Sequence[Any], fixed: Mask | None = None
    ) -> None:
        """Add the tangent, and set the diagonal of `fixed` owned unknowns, those that the
        conditions prescribe, to one."""
        if self.has_several or fixed is None:
            none = np.zeros(0, dtype=bool)
            rows = self._contact.layout.begin + np.flatnonzero(
                none if fixed is None else fixed
            )
            starts = self._unknowns.starts
            compat.assemble_blocks(A, self._a, bcs, starts, rows.astype(np.int32))
        elif self._a is not None:
            compat.assemble_jacobian(A, self._a, bcs)


class Updated:
    """Calls the user's function once for each state of the unknowns. Collective."""

    def __init__(self, unknowns: Unknowns, function: Callable[[], object]) -> None:
        self._unknowns, self._function = unknowns, function
        # Unknowns of the last call; None: it has to be called again
        self._last: Array | None = None
        self._is_new = False

    def bring(self) -> None:
        """Call the function if the unknowns have changed since its last call."""
        comm, now = self._unknowns.comm, self._unknowns.values()
        changed = self._last is None or not np.array_equal(self._last, now)
        if not comm.allreduce(changed, op=MPI.LOR):
            return
        self._last = None
        with together(comm):
            self._function()
        self._last, self._is_new = now, True

    def bring_for_residual(self) -> None:
        """As `bring`, and again where a residual has been assembled before: only a new
        solve asks for it at the same unknowns, and loads may have changed."""
        if not self._is_new:
            self._last = None
        self.bring()
        self._is_new = False

    def forget(self) -> None:
        """Call the function next time though the unknowns stay the same."""
        self._last = None


class Volume:
    """Residual and tangent of compiled forms, of all unknowns of the forms. Collective.

    Parameters
    ----------
    contact
        Contact, or several.
    L, a
        Compiled residual and tangent, as lists where there are several unknowns.
    forms
        The residual in UFL, if the tangent is its derivative: where that does not depend
        on the unknowns, it is assembled once, and the residual is a product with it.
        Else None.
    pattern
        Of the tangent, where it may be kept.
    updated
        What the user's function has set of the forms' coefficients. Then nothing of the
        forms is kept: their derivatives do not show how coefficients change.

    Attributes
    ----------
    kept
        What is kept of linear forms, as of the last residual or tangent. None: nothing.
    """

    def __init__(
        self,
        contact: Any,
        L: Any,
        a: Any,
        forms: Any = None,
        pattern: Any = None,
        updated: Updated | None = None,
    ) -> None:
        self.contact, self.L, self.a = contact, L, a
        self.updated = updated
        self.has_several = isinstance(L, list)
        self.kept: Any = None
        self._forms = Forms(contact, L, a)
        if forms is not None and updated is None and hooks.keeper is not None:
            forms = forms if self.has_several else [forms]
            self.kept = hooks.keeper(contact, self._forms, pattern, forms)

    @property
    def is_linear(self) -> bool:
        """Whether the tangent is kept."""
        return self.kept is not None

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Residual at the present state, of the owned unknowns. Collective."""
        return self.residual(bcs, None)

    def residual(self, bcs: Sequence[Any], increment: Array | None) -> Array:
        """Residual of the owned unknowns, with the effect of prescribed increments if
        they are given. Collective."""
        if self.updated is not None:
            self.updated.bring()
        if self.kept is None:
            return self._forms.residual(bcs, increment)
        unknowns = self.contact.unknowns
        self.kept.renew(unknowns.owned_prescribed(bcs))
        values = unknowns.owned_values()
        if increment is not None:
            values += unknowns.owned_part(increment)
        return self.kept.forces(values)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, with ones for constrained unknowns. Collective."""
        if self.updated is not None:
            self.updated.bring()
        fixed = self.contact.unknowns.owned_prescribed(bcs)
        if self.kept is None:
            self._forms.add_tangent(A, bcs, fixed)
        else:
            self.kept.renew(fixed)
            self.kept.add_tangent(A)
