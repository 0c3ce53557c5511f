"""An inner loop of Newton's method at fixed segments, and an outer loop that pairs."""

from __future__ import annotations

from typing import Any

from ..checked import is_whole_number
from ..errors import ContactError, ConvergenceError, require_agreement, together
from .solver import CoupledSolver, check_unknowns


class FixedPointSolver:
    """Fixed point on the pairing, in place of Newton's method on everything.
    Collective.

    The inner solver keeps segments, integration points and weights, and casts rays
    only: its tangent is the exact derivative of this residual. The outer loop pairs
    anew until the residual of the new pairing is small too. The inner solver alone has
    the same solution.

    Parameters
    ----------
    solver
        `NewtonSolver` or `SNESSolver`, with its tolerances.
    max_outer
        Largest number of pairings in one solve.

    Attributes
    ----------
    problem
        Of the inner solver.
    residuals
        Norm after each pairing of the last solve, the first before any iteration.
        Force.
    """

    def __init__(self, solver: CoupledSolver, max_outer: int = 20) -> None:
        if not isinstance(solver, CoupledSolver):
            message = f"solver must be a NewtonSolver or an SNESSolver, not {solver!r}"
            raise ContactError(message)
        with together(solver.problem.comm):
            if not (is_whole_number(max_outer) and max_outer >= 1):
                raise ContactError(
                    f"max_outer = {max_outer!r} must be positive and a whole number"
                )
        require_agreement(solver.problem.comm, max_outer=max_outer)
        self.solver, self.max_outer = solver, max_outer
        self.problem = solver.problem
        self.residuals: list[float] = []
        self._b = self.problem.create_vector()

    def solve(self, u: Any = None) -> tuple[int, bool]:
        """Solve from the present u and multiplier, as `SNESSolver.solve`.

        Returns
        -------
        iterations, converged
            Inner iterations of all pairings.

        Raises
        ------
        ConvergenceError
            If an inner solve fails, or if the pairing has not settled.
        """
        check_unknowns(self.problem, u)
        convergence = self.problem.convergence
        self.residuals = [self._residual()]
        # Tolerances are relative to the first pairing, not to the start of each one
        convergence.keeps_first = self.problem.rays_only = True
        rtol, atol = self.solver.tolerances[0], self.solver.force_tolerance
        iterations = 0
        try:
            for _ in range(self.max_outer):
                iterations += self.solver.solve()[0]
                self.residuals.append(self._residual())
                if convergence.reached(rtol, atol, at_once=True):
                    return iterations, True
        finally:
            convergence.keeps_first = self.problem.rays_only = False
        found = ", ".join(f"{r:.3e}" for r in self.residuals)
        raise ConvergenceError(
            f"the pairing has not settled after {self.max_outer} pairings: residuals "
            f"{found}; {self.problem.contact.statistics}"
        )

    def _residual(self) -> float:
        """Pair anew at the present state; find the norm of the residual."""
        x = self.problem.start()
        kept, self.problem.rays_only = self.problem.rays_only, False
        try:
            self.problem.F(x, self._b)
        finally:
            self.problem.rays_only = kept
            x.destroy()
        return self.problem.history[-1]
