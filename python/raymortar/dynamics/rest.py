"""Static balance of values without mass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.discretization.ranks import destroy
from ..core.problem import CoupledProblem
from ..core.terms import Term

# Tolerance of initial accelerations, and of static balances
EXACT = 1e-14


def conjugate_gradients(A: PETSc.Mat) -> PETSc.KSP:
    """Make a solver of a symmetric matrix. Collective."""
    ksp = PETSc.KSP().create(A.comm)
    ksp.setOperators(A)
    ksp.setType("cg")
    ksp.getPC().setType("jacobi")
    ksp.setTolerances(rtol=EXACT, max_it=10000)
    return ksp


class Rest:
    """Finds where forms and bonds hold values without mass, by one Newton iteration.

    Of linear bodies it is exact. The volume is that without inertia. Collective.
    """

    def __init__(
        self, problem: CoupledProblem, volume: Any, bonds: Sequence[Term]
    ) -> None:
        self._problem, self._volume, self._bonds = problem, volume, bonds
        # Making room may pair surfaces anew, at the present unknowns
        self._K = problem.create_matrix()
        self._ksp: Any = None
        self._chosen: Mask = np.zeros(0, dtype=bool)

    def change(self, chosen: Mask) -> Array:
        """Change of the owned unknowns, (n,), with which forms and bonds are in balance
        at chosen ones."""
        begin, comm = self._problem.contact.layout.begin, self._problem.comm
        found, rows = np.zeros(len(chosen)), np.flatnonzero(chosen)
        if comm.allreduce(len(rows)) == 0:
            return found
        forces = self._volume.forces(self._problem.bcs)
        for bond in self._bonds:
            forces = forces + bond.forces(self._problem.bcs)
        ksp = self._factors(chosen, rows + begin)
        x, b = ksp.getOperators()[0].createVecs()
        b.array[:] = -forces[rows]
        ksp.solve(b, x)
        if ksp.getConvergedReason() > 0:  # else the forms have no balance near here
            found[rows] = x.array_r
        destroy(x, b)
        return found

    def _factors(self, chosen: Mask, rows: Indices) -> Any:
        """Factors of the tangent between chosen unknowns, kept where it is linear."""
        comm = self._problem.comm
        anew = self._ksp is None or not np.array_equal(chosen, self._chosen)
        is_linear = self._volume.is_linear and not self._bonds
        if not comm.allreduce(int(anew)) and is_linear:
            return self._ksp
        self._K.zeroEntries()
        self._volume.add_tangent(self._K, self._problem.bcs)
        for bond in self._bonds:
            self._K.assemble()
            bond.add_matrices(self._K, self._problem.bcs)
        self._K.assemble()
        own = PETSc.IS().createGeneral(rows.astype(PETSc.IntType), comm=comm)
        part = self._K.createSubMatrix(own, own)
        own.destroy()
        destroy(self._ksp)
        self._chosen, self._ksp = chosen.copy(), conjugate_gradients(part)
        part.destroy()  # the solver keeps it
        return self._ksp
