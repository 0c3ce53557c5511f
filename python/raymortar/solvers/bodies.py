"""Preconditioner that needs about as many iterations as the bodies without contact."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from .elimination import ContactPreconditioner
from .levels import BodiesLevels, set_levels
from .near_contact import NearContact, rows_near_contact

# New levels are made when a solve needs WORN times the cycles of the first one, and
# SPARE more: the bodies have changed then
WORN, SPARE = 1.5, 5


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
        self._near_contact: Any = None
        self._rows: Any = None
        self._coarse: list[PETSc.Mat] = []
        # Cycles since the last set-up, and those after the levels were made
        self._cycles = self._first = 0

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the blocks of the tangent anew. Collective."""
        super().setUp(pc)
        prefix = f"{pc.getOptionsPrefix() or ''}near_"
        if self._rows is None:
            self._rows = rows_near_contact(self.contact)
        self._near_contact = NearContact(pc.getOperators()[0], self._rows, prefix)
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
        """y = P^-1 x: near contact first, then everywhere. Collective."""
        A, _ = pc.getOperators()
        self._cycles += 1
        rest, further = x.duplicate(), x.duplicate()
        self._near_contact.solve(x, y)
        A.mult(y, rest)
        rest.aypx(-1.0, x)
        super().apply(pc, rest, further)
        y.axpy(1.0, further)
        rest.destroy()
        further.destroy()

    def reset(self, pc: PETSc.PC) -> None:
        """Forget the operators: the next ones may have another pattern. Collective."""
        super().reset(pc)
        self._destroy("_near_contact")
        for matrix in self._coarse:
            matrix.destroy()
        self._coarse = []

    def destroy(self, pc: PETSc.PC) -> None:
        """The end, called by PETSc. Collective."""
        super().destroy(pc)
        self._destroy("levels", "_rows")
