"""A direct solver for the unknowns near contact, before each cycle of multigrid."""

from __future__ import annotations

from typing import TYPE_CHECKING

from petsc4py import PETSc

import numpy as np

from .. import compat
from ..host.ranks import marked_everywhere

if TYPE_CHECKING:
    from ..interaction import Interaction

# Layers of cells at the surfaces whose nodes are near contact (measured:
# docs/parallel.md)
LAYERS = 1


class NearContact:
    """Solves for the displacement near the surfaces of contact, for all multipliers and
    for rigid bodies that are free. Collective.

    Parameters
    ----------
    A
        Coupled tangent.
    rows
        Owned rows near contact, from `rows_near_contact`.
    prefix
        Prefix of the solver's options.
    """

    def __init__(self, A: PETSc.Mat, rows: PETSc.IS, prefix: str) -> None:
        self._rows = rows
        self._part = A.createSubMatrix(rows, rows)
        self._x, self._b = self._part.createVecs()
        self._ksp = PETSc.KSP().create(A.comm)
        self._ksp.setOptionsPrefix(prefix)
        self._ksp.setType("preonly")
        self._ksp.setOperators(self._part)
        self._ksp.setFromOptions()
        self._ksp.setUp()

    def solve(self, right: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = A_nn^-1 right at the rows near contact, 0 elsewhere. Collective."""
        part = right.getSubVector(self._rows)
        part.copy(self._b)
        right.restoreSubVector(self._rows, part)
        self._ksp.solve(self._b, self._x)
        y.set(0.0)
        part = y.getSubVector(self._rows)
        self._x.copy(part)
        y.restoreSubVector(self._rows, part)

    def destroy(self) -> None:
        """Free what belongs to it. Collective."""
        for thing in (self._ksp, self._part, self._x, self._b):
            thing.destroy()


def rows_near_contact(contact: Interaction, layers: int = LAYERS) -> PETSc.IS:
    """Owned rows near contact: the displacement on its surfaces and in some layers of
    cells behind them, all multipliers and free bodies. Collective.

    Parameters
    ----------
    contact
        Contact, or several.
    layers
        Number of layers of cells.
    """
    V, layout = contact.u.function_space, contact.layout
    bs, owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    sides = [
        side.dofs
        for zone in contact.zones
        for side in (zone.facets.slave_surface, zone.facets.master_surface)
    ]
    near = marked_everywhere(V, np.concatenate(sides))
    table = compat.dofmap_array(V)
    for _ in range(layers):
        near[table[near[table].any(axis=1)]] = True
        near = marked_everywhere(V, np.flatnonzero(near))
    nodes = np.flatnonzero(near[:owned])
    u = layout.begin + (bs * nodes[:, None] + np.arange(bs)).ravel()
    others = np.arange(layout.begin + layout.n, layout.begin + layout.size)
    rows = np.concatenate([u, others]).astype(PETSc.IntType)
    return PETSc.IS().createGeneral(rows, comm=layout.comm)
