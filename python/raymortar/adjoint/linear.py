"""The linear system of an adjoint at a state."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from ..core.discretization.ranks import destroy
from ..core.errors import SetUpError, raise_everywhere

# Residual over the forces in balance from which on a state has not converged
NOT_CONVERGED = 1e-4


class Linearised:
    """A problem at its present state, where its residual is zero. Collective.

    Attributes
    ----------
    problem
        The problem, with multipliers among its unknowns.
    """

    def __init__(self, problem: Any) -> None:
        self.problem, self.system = problem, problem.contact.system
        for part in problem.contact.parts:
            part.present.require_results()
        before = list(problem.history)
        self._x = problem.start()
        problem.history[:] = before
        problem.form(self._x)
        # The first iterate of a step leaves the motion of segments out of the tangent
        self.system.update()
        problem.form(self._x)
        self._A: PETSc.Mat | None = None
        self._M: PETSc.Mat | None = None
        self._ksp: PETSc.KSP | None = None

    def require_converged(self) -> None:
        """Raise where the state does not solve the problem. Collective."""
        before, b = list(self.problem.history), self.problem.create_vector()
        self.problem.F(self._x, b)
        b.destroy()
        self.problem.history[:] = before
        convergence = self.problem.convergence
        last = convergence.now
        forces = np.linalg.norm(last.forces[: last.count])
        message = None
        if not last.norm <= max(NOT_CONVERGED * forces, convergence.floor):
            message = (
                f"the residual at the present state is {last.norm:.3g}, of forces of "
                f"{forces:.3g}: solve the problem first, and call gradient before "
                "contact.advance()"
            )
        raise_everywhere(self.problem.comm, message, SetUpError)

    def destroy(self) -> None:
        """Free PETSc's objects. Collective."""
        destroy(*filter(None, (self._x, self._ksp, self._A, self._M)))

    # The transposed system

    def solve(self, right: PETSc.Vec) -> PETSc.Vec:
        """Solve A^T lam = right [theory (8.3)]; lam is zero where conditions prescribe
        unknowns. Collective."""
        problem = self.problem
        if self._ksp is None:
            self._A = problem.create_matrix()
            problem.J(self._x, self._A)
            self._ksp = direct_solver(self._A)
        found = problem.create_vector()
        self._ksp.solveTranspose(right, found)
        found.array[: self.system.layout.n][problem.prescribed] = 0.0
        return found

    def by_unknowns(self, weights: PETSc.Vec) -> PETSc.Vec:
        """Derivative of contact's weighed residual by all unknowns, prescribed ones too.
        Collective."""
        M = self._matrix()
        self.system.constrained(())
        self.system.add_tangent(M, ())
        y = self._product(M, weights)
        self.system.constrained(self.problem.bcs)
        return y

    def _matrix(self) -> PETSc.Mat:
        """Zero matrix with room for all rows and columns. Collective."""
        if self._M is None:
            self._M = self.problem.create_matrix()
            self._M.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        else:
            self._M.zeroEntries()
        return self._M

    def _product(self, M: PETSc.Mat, weights: PETSc.Vec) -> PETSc.Vec:
        """Multiply a matrix from the left by weights. Collective."""
        M.assemble()
        y = self.problem.create_vector()
        M.multTranspose(weights, y)
        return y


def direct_solver(A: PETSc.Mat) -> PETSc.KSP:
    """Make a direct solver of a matrix. Collective."""
    ksp = PETSc.KSP().create(A.comm)
    ksp.setOperators(A)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.LU)
    pc.setFactorSolverType("mumps")
    pc.setFactorSetUpSolverType()
    pc.getFactorMatrix().setMumpsIcntl(14, 60)
    return ksp
