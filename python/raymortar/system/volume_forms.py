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
        maps = [compat.unknowns_of(f) for f in contact.host.functions]
        self._r = [compat.create_la_vector(*one) for one in maps]
        sizes = [index_map.size_local * bs for index_map, bs in maps]
        self._rows = [r.array for r in self._r]
        self._owned = [r[:n] for r, n in zip(self._rows, sizes)]
        self._forms = L if self.has_several else [L]
        self._alone = contact.host.comm.size == 1

    @property
    def has_several(self) -> bool:
        """Whether there are forms for several unknowns."""
        return isinstance(self.L, list)

    def residual(
        self, bcs: Sequence[Any] = (), increment: Array | None = None
    ) -> Array:
        """The residual of the owned unknowns, with the effect of prescribed increments
        if they are given. Collective."""
        for r, form in zip(self._rows, self._forms):
            r[:] = 0.0
            if form is not None:
                compat.assemble_residual(r, form)
        if increment is not None and increment.any():
            self._lift(bcs, increment)
        if not self._alone:
            for r in self._r:
                compat.scatter_reverse_add(r)
        if len(self._owned) == 1:
            return self._owned[0].copy()
        return np.concatenate(self._owned)

    def _lift(self, bcs: Sequence[Any], increment: Array) -> None:
        """Add the effect of prescribed increments to the residual."""
        host = self._contact.host
        conditions = host.conditions(bcs)
        parts = np.split(increment, host.starts[1:-1])
        for r, blocks in zip(self._rows, self.a if self.has_several else [[self.a]]):
            for part, block, g, of_g in zip(parts, blocks, host.functions, conditions):
                # Takes the tangents of all cells with constrained dofs
                if block is not None and part.any():
                    compat.apply_lifting(r, block, of_g, g.x.array, -1.0)

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
