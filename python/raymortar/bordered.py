"""Newton's method on displacement, multiplier and load factor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mpi4py import MPI
from petsc4py import PETSc

from .compat import Array
from .errors import require_agreement
from .solver import NewtonSolver, SNESSolver, renew, require_convergence

# Of the path: what the load factor is changed by to see what that does. The residual is
# linear in loads and prescribed displacements, contact does not enter, so that rounding
# alone counts where `apply` is linear
CHANGE = 1e-6


class BorderedSolver:
    """Solves for the load factor too, by a constraint. Collective.

    Each iteration solves twice with one factorised tangent: for the residual and for
    its derivative by the load factor.

    Parameters
    ----------
    solver
        Its tangent, linear solver, tolerances and most iterations are taken.
    apply
        Function of the load factor.
    constraint
        One of `constraints`.
    factor
        Load factor at first.
    change
        Of the load factor, for derivatives.

    Attributes
    ----------
    factor
        Load factor: where a solve starts, and where it has ended.
    """

    def __init__(
        self,
        solver: NewtonSolver | SNESSolver,
        apply: Callable[[float], Any],
        constraint: Any,
        factor: float,
        change: float,
    ) -> None:
        self.solver, self.problem = solver, solver.problem
        self._apply, self._constraint = apply, constraint
        self.factor, self._change = factor, change

    def solve(self) -> tuple[int, bool]:
        """Solve from the present displacement, multiplier and load factor.

        Returns
        -------
        iterations, converged

        Raises
        ------
        ConvergenceError
            The load factor is then what it was.
        """
        solver, problem, start = self.solver, self.problem, self.factor
        require_agreement(problem.comm, max_it=solver.max_it, rtol=solver.tolerances)
        x, vectors = problem.start(), [problem.create_vector() for _ in range(4)]
        iterations, reason = 0, None
        try:
            with solver.options:
                iterations, reason = self._iterate(x, *vectors)
            converged = reason is None
        except BaseException:
            self.factor = start
            renew(solver.krylov_solver, solver.A)
            raise
        finally:
            for vector in (x, *vectors):
                vector.destroy()
        if not converged:
            self.factor = start
            renew(solver.krylov_solver, solver.A)
        require_convergence(problem, converged, f"after {iterations} iterations{reason}")
        self._constraint.check(self.factor)
        return iterations, True

    def _iterate(
        self, x: PETSc.Vec, b: PETSc.Vec, slope: PETSc.Vec, dx: PETSc.Vec, v: PETSc.Vec
    ) -> tuple[int, str | None]:
        """Iterations, and why they failed if they have."""
        solver, convergence = self.solver, self.problem.convergence
        rtol, atol = solver.tolerances[0], solver.force_tolerance
        iteration = 0
        while True:
            self._apply(self.factor)
            self.problem.F(x, b)
            if iteration:  # a step starts from a solution, which is no measure
                convergence.accept()
            balanced = convergence.reached(rtol, atol)
            if balanced and self._constraint.is_met(self.factor):
                return iteration, None
            if convergence.is_stuck:
                return iteration, ", and was stopped"
            if iteration == solver.max_it:
                return iteration, ""
            self._differentiate(slope, dx)
            solver.linearise(x)
            solver.correct(b, dx)
            solver.correct(slope, v)
            if not self._take(x, dx, v):
                return iteration, " (the linear solver failed)"
            iteration += 1

    def _differentiate(self, slope: PETSc.Vec, loads: PETSc.Vec) -> None:
        """Derivative of the residual by the load factor, after `NonlinearProblem.F`;
        `loads` is for work."""
        h = self._change
        self.problem.loads(loads)
        self._apply(self.factor + h)
        self.problem.loads(slope)
        self._apply(self.factor)
        slope.axpy(-1.0, loads)
        slope.scale(1.0 / h)

    def _take(self, x: PETSc.Vec, dx: PETSc.Vec, v: PETSc.Vec) -> bool:
        """Go on to the next iterate, if there is one. Collective."""
        parts: list[Array] = [part.getArray(readonly=True) for part in (dx, v)]
        finite = all(np.isfinite(part).all() for part in parts)
        if not self.problem.comm.allreduce(finite, op=MPI.LAND):
            return False
        step = self._constraint.correction(self.factor, *parts)
        x.axpy(-1.0, dx)
        x.axpy(-step, v)
        self.factor += step
        return bool(np.isfinite(step))
