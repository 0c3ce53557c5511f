"""The user's forms, compiled: residual and tangent of the volume."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import compat
from ..compat import Array, Mask
from .host import Host


class Volume:
    """Assembles everything but contact. Collective.

    Parameters
    ----------
    host
        What the user solves for.
    L, a
        Compiled residual and Jacobian. For several unknowns a list by unknown, and a
        list of lists by test and trial space, None for a block that is zero.
    """

    def __init__(self, host: Host, L: Any, a: Any) -> None:
        self.host, self.L, self.a = host, L, a
        self._r = [
            compat.create_la_vector(*compat.unknowns_of(f)) for f in host.functions
        ]

    @property
    def has_several(self) -> bool:
        """Whether there are forms for several unknowns."""
        return isinstance(self.L, list)

    def _table(self) -> tuple[list[Any], list[list[Any]]]:
        """Forms by unknown, and by test and trial space."""
        return (self.L, self.a) if self.has_several else ([self.L], [[self.a]])

    def residual(self) -> Array:
        """Residual at the present state, for the owned unknowns. Collective."""
        rows, (L, _) = [], self._table()
        for r, form, f in zip(self._r, L, self.host.functions):
            r.array[:] = 0.0
            compat.assemble_residual(r.array, form)
            compat.scatter_reverse_add(r)
            index_map, bs = compat.unknowns_of(f)
            rows.append(r.array[: index_map.size_local * bs])
        return np.concatenate(rows)

    def lifted(self, bcs: Sequence[Any], increment: Array) -> tuple[Array, Array]:
        """Residual with the effect of prescribed increments. Collective.

        Parameters
        ----------
        bcs
            Dirichlet conditions.
        increment
            Prescribed minus present values, for the local unknowns.

        Returns
        -------
        residual, rows
            For the owned unknowns: the residual, and the same with the conditions in
            the constrained rows.
        """
        host = self.host
        conditions, starts = host.conditions(bcs), host.starts
        parts = [increment[begin:end] for begin, end in zip(starts, starts[1:])]
        residual, rows = [], []
        L, a = self._table()
        for r, form, blocks, f, own in zip(self._r, L, a, host.functions, conditions):
            r.array[:] = 0.0
            compat.assemble_residual(r.array, form)
            for part, block, g, of_g in zip(parts, blocks, host.functions, conditions):
                # Takes the tangents of all cells with constrained dofs
                if block is not None and part.any():
                    compat.apply_lifting(r.array, block, of_g, g.x.array, -1.0)
            compat.scatter_reverse_add(r)
            index_map, bs = compat.unknowns_of(f)
            n = index_map.size_local * bs
            residual.append(r.array[:n].copy())
            compat.set_bc(r.array, own, f.x.array, -1.0)
            rows.append(r.array[:n])
        return np.concatenate(residual), np.concatenate(rows)

    def add_tangent(
        self, A: PETSc.Mat, bcs: Sequence[Any], begin: int, fixed: Mask
    ) -> None:
        """Add the tangent. Collective.

        Parameters
        ----------
        A
            Matrix over [u, multiplier]. The caller assembles it afterwards.
        bcs
            Dirichlet conditions.
        begin
            First row of this rank.
        fixed
            Whether conditions prescribe an owned unknown of the host.
        """
        if not self.has_several:
            compat.assemble_jacobian(A, self.a, bcs)
            return
        rows = (begin + np.flatnonzero(fixed)).astype(np.int32)
        compat.assemble_blocks(A, self.a, bcs, self.host.starts, rows)

    def with_form_of_u(self, L: Any, a: Any) -> tuple[Any, Any]:
        """L and a, with others in the place of those in the displacement's test
        function."""
        if not self.has_several:
            return L, a
        at = self.host.only.at
        forms, table = list(self.L), list(map(list, self.a))
        forms[at], table[at][at] = L, a
        return forms, table

    @contextmanager
    def replaced(self, L: Any, a: Any) -> Iterator[None]:
        """Assemble other forms for a while."""
        kept = self.L, self.a
        self.L, self.a = L, a
        try:
            yield
        finally:
            self.L, self.a = kept
