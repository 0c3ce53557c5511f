"""Preconditioner that needs about as many iterations as the bodies without contact."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import compat
from ..compat import Indices
from ..host.ranks import marked_everywhere
from .elimination import ContactPreconditioner
from .levels import BodiesLevels, set_levels
from .petsc_objects import inner_solver

# New levels are made when a solve needs WORN times the cycles of the first one, and
# SPARE more: the bodies have changed then
WORN, SPARE = 1.5, 5

# Layers of cells at the surfaces whose nodes are near contact (measured:
# docs/parallel.md)
LAYERS = 1


class BodiesPreconditioner(ContactPreconditioner):
    """Solves near contact directly, and everywhere by multigrid. A PETSc python PC.

    1. A direct solver finds the displacement near contact, all multipliers, and the
       motions of free rigid bodies. The rest of the error is smooth.
    2. `ContactPreconditioner` eliminates the multipliers. Springs as stiff as the
       volume's surface stand for closed contact, which multigrid solves well.

    The levels are those of the bodies without contact. They are kept until a solve
    takes many more cycles than the first one, or until other dofs are prescribed.

    Attributes
    ----------
    levels
        `levels.BodiesLevels`, from the first set-up on.
    """

    springs = 1.0
    takes_bodies = True

    def __init__(self) -> None:
        super().__init__()
        self.levels: Any = None
        # The solver near contact, and its owned rows
        self._near_contact: Any = None
        self._near_rows: Indices | None = None
        self._coarse: list[PETSc.Mat] = []
        # Cycles since the last set-up, and those after the levels were made
        self._cycles = self._first = 0

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the blocks of the tangent anew. Collective."""
        super().setUp(pc)
        A, _ = pc.getOperators()
        if self._near_rows is None:
            self._near_rows = _rows_near_contact(self.contact)
        at = (self._near_rows + A.getOwnershipRange()[0]).astype(PETSc.IntType)
        rows = PETSc.IS().createGeneral(at, comm=A.comm)
        part = A.createSubMatrix(rows, rows)
        self._near_contact = inner_solver(pc, "near_")
        self._near_contact.setType("preonly")
        self._near_contact.setOperators(part)
        self._near_contact.setFromOptions()
        self._near_contact.setUp()
        part.destroy()  # the solver has it
        self._cycles = 0

    def _renew(self, prefix: str) -> None:
        if self._first == 0:
            self._first = self._cycles
        if self._cycles > WORN * self._first + SPARE or self._has_other_conditions():
            self._destroy("levels")
        if self.levels is None:
            self.levels = BodiesLevels(self.problem, f"{prefix}levels_")
            self._first = 0

    def _prepare(self, S: PETSc.Mat) -> None:
        # Springs in place of multipliers are as stiff as the surface of the volume,
        # penalties ten times as stiff
        stiff = any(one.multiplier is None for one in self.contact.contacts)
        self._coarse = set_levels(self.solver, self.levels, S, stiff)

    def _has_other_conditions(self) -> bool:
        """Whether other dofs are prescribed than when the levels were made.
        Collective."""
        if self.levels is None:
            return False
        same = np.array_equal(self.levels.fixed, self.problem.constrained)
        return bool(self.contact.layout.comm.allreduce(int(not same)))

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve near contact first, then everywhere. Collective."""
        A, _ = pc.getOperators()
        part, _ = self._near_contact.getOperators()
        self._cycles += 1
        rest, further = x.duplicate(), x.duplicate()
        near, right = part.createVecs()
        right.array[:] = x.array_r[self._near_rows]
        self._near_contact.solve(right, near)
        y.set(0.0)
        y.array[self._near_rows] = near.array_r
        A.mult(y, rest)
        rest.aypx(-1.0, x)
        super().apply(pc, rest, further)
        y.axpy(1.0, further)
        for vector in (rest, further, near, right):
            vector.destroy()

    def reset(self, pc: PETSc.PC) -> None:
        """Forget the operators, as the next ones may have another pattern. Collective."""
        super().reset(pc)
        self._destroy("_near_contact")
        for matrix in self._coarse:
            matrix.destroy()
        self._coarse = []

    def destroy(self, pc: PETSc.PC) -> None:
        """Free all, as PETSc asks at the end. Collective."""
        super().destroy(pc)
        self._destroy("levels")


def _rows_near_contact(contact: Any) -> Indices:
    """Owned rows near contact: the displacement on its surfaces and in some layers of
    cells behind them, all multipliers and free bodies. Collective."""
    V, layout = contact.u.function_space, contact.layout
    bs, owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    sides = [
        side.dofs
        for zone in contact.zones
        for side in (zone.facets.slave_surface, zone.facets.master_surface)
    ]
    near = marked_everywhere(V, np.concatenate(sides))
    table = compat.dofmap_array(V)
    for _ in range(LAYERS):
        near[table[near[table].any(axis=1)]] = True
        near = marked_everywhere(V, np.flatnonzero(near))
    nodes = np.flatnonzero(near[:owned])
    u = (bs * nodes[:, None] + np.arange(bs)).ravel()
    return np.concatenate([u, np.arange(layout.n, layout.size)])
