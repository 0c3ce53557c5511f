"""Corrections of Newton's iterates by the factors of their last tangent."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

from petsc4py import PETSc

from ..core.discretization.ranks import destroy
from ..core.errors import ConvergenceError, NotFinite
from ..core.solvers.newton import NewtonSolver, SNESSolver
from .lagging_factors import LaggedFactorsSolver
from .settings import temporarily

LINE_SEARCH = "snes_linesearch_type"

# Largest shares of the residual that an iteration leaves whose iterate is corrected, and
# that a correction leaves after which another one follows
ITERATION_LEAVES, LEAVES = 0.1, 0.3

# Share of the tolerances at which corrections end. They converge linearly, and would
# stop right below the tolerances; Newton's method mostly ends far below
SURPLUS = 1e-4


class Corrections:
    """Corrects an iterate by the tangent that led to it, up to a solution. Collective.

    A correction takes a residual and a solve with factors that exist, which is less than
    an iteration. An iterate is corrected if its iteration has left a small share of the
    residual, and as long as each correction does [theory (5.26)]. If corrections do not
    end at a solution, the iterate is restored: a path has the iterates of Newton's
    method but for the last ones of a step.
    """

    def __init__(self, solver: Any) -> None:
        self._solver, self._problem = solver, solver.problem

    def __call__(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Correct an iterate, and b, its residual."""
        history, now = self._problem.history, self._problem.convergence.now
        if len(history) < 2 or history[-1] > ITERATION_LEAVES * history[-2]:
            return
        # The norm contains forces only: a temperature may diverge while it falls
        if len(now.residual) > now.count or self._has_ended(1.0):
            return
        count, best = len(history), (x.copy(), b.copy())
        try:
            while self._corrects(x, b):
                if self._has_ended(1.0):
                    now = self._problem.convergence.now
                    x.copy(best[0])
                    b.copy(best[1])
                    if self._has_ended(SURPLUS):
                        break
            else:
                best[0].copy(x)
                best[1].copy(b)
                self._problem.form(x)
                self._problem.convergence.now = now
        finally:
            destroy(*best)
        # Each iterate is in the history once
        history[count - 1 :] = [now.norm]

    def _has_ended(self, share: float) -> bool:
        """Whether the iterate is a solution to a share of the tolerances, or down to
        rounding, or is not yet where it is prescribed."""
        convergence, solver = self._problem.convergence, self._solver
        rtol, atol = share * solver.tolerances[0], solver.force_tolerance
        if convergence.is_pending(rtol):
            return True
        atol = atol if atol is None else share * atol
        return bool(convergence.reached(rtol, atol, at_once=share < 1.0))

    def _corrects(self, x: PETSc.Vec, b: PETSc.Vec) -> bool:
        """Correct once; return whether that has left a small share of the residual."""
        convergence, change = self._problem.convergence, b.duplicate()
        before = convergence.now.norm
        try:
            self._solver.krylov_solver.solve(b, change)
            x.axpy(-1.0, change)
            self._problem.F(x, b)
        except (ConvergenceError, NotFinite):
            return False
        finally:
            destroy(change)
        if self._solver.scale is not None:
            b.pointwiseMult(b, self._solver.scale)
        return bool(convergence.now.norm <= LEAVES * before)


def takes_full_steps(solver: Any) -> bool:
    """Whether a solver is of a known kind, and takes Newton's steps as they are."""
    if isinstance(solver, SNESSolver):
        is_basic = solver.options.given.get(LINE_SEARCH) == "basic"
        return is_basic and solver.snes.getType() == "newtonls"
    known = isinstance(solver, NewtonSolver)
    return known and solver.convergence_criterion == "residual"


def has_own_factors(ksp: PETSc.KSP) -> bool:
    """Whether a linear solver factorises tangents, so that a second system takes little.
    Multigrid's takes more than a tangent (docs/measured/load_steps.md)."""
    if ksp.getType() == "python":
        return isinstance(ksp.getPythonContext(), LaggedFactorsSolver)
    return ksp.getType() == "preonly" and ksp.getPC().getType() in ("lu", "cholesky")


def correcting(solver: Any) -> AbstractContextManager[Any]:
    """Have iterates of a solver corrected for a while, if that may save time: it takes
    full steps, and factorises tangents."""
    damped = getattr(solver, "relaxation_parameter", 1.0) != 1.0
    if damped or not takes_full_steps(solver):
        return nullcontext()
    if not has_own_factors(solver.krylov_solver):
        return nullcontext()
    return temporarily(solver, on_iterate=Corrections(solver))
