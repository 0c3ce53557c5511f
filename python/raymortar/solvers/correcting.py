"""Further corrections of Newton's iterates, by the factors that there are."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

from petsc4py import PETSc

from ..core.discretization.ranks import destroy
from ..core.errors import ConvergenceError, NotFinite
from ..core.solvers.newton import NewtonSolver, SNESSolver
from .settings import temporarily

LINE_SEARCH = "snes_linesearch_type"

# Share of the residual that a correction may leave
LEAVES = 0.3


class Corrections:
    """Corrects iterates again by the tangent that led to them. Collective.

    A residual and a solve with the factors that there are take a small part of an
    iteration. So a tangent whose correction has left at most a share of the residual
    makes the next one, too, as long as each leaves no more than that [theory (5.26)].
    """

    def __init__(self, solver: Any) -> None:
        self._solver, self._problem = solver, solver.problem

    def __call__(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Correct an iterate, and b, its residual."""
        history = self._problem.history
        if len(history) > 1 and history[-1] <= LEAVES * history[-2]:
            while not self._has_ended() and self._corrects(x, b):
                pass

    def _has_ended(self) -> bool:
        """Whether the iterate is a solution, or is not yet where it is prescribed."""
        convergence, rtol = self._problem.convergence, self._solver.tolerances[0]
        limits = rtol, self._solver.force_tolerance
        return bool(convergence.is_pending(rtol) or convergence.reached(*limits))

    def _corrects(self, x: PETSc.Vec, b: PETSc.Vec) -> bool:
        """Correct once, and take that back if it leaves too much; return whether it
        stays."""
        problem, history = self._problem, self._problem.history
        found, count = problem.convergence.now, len(history)
        before, change = (x.copy(), b.copy()), b.duplicate()
        self._solver.krylov_solver.solve(b, change)
        x.axpy(-1.0, change)
        try:
            problem.F(x, b)
            stays = bool(problem.convergence.now.norm <= LEAVES * found.norm)
        except (ConvergenceError, NotFinite):
            stays = False
        if stays:
            if self._solver.scale is not None:
                b.pointwiseMult(b, self._solver.scale)
            # Each iterate is in the history once
            del history[count - 1]
        else:
            del history[count:]
            before[0].copy(x)
            before[1].copy(b)
            problem.form(x)
            problem.convergence.now = found
        destroy(change, *before)
        return stays


def takes_full_steps(solver: Any) -> bool:
    """Whether a solver is of a known kind, and takes Newton's steps as they are."""
    if isinstance(solver, SNESSolver):
        is_basic = solver.options.given.get(LINE_SEARCH) == "basic"
        return is_basic and solver.snes.getType() == "newtonls"
    known = isinstance(solver, NewtonSolver)
    return known and solver.convergence_criterion == "residual"


def correcting(solver: Any) -> AbstractContextManager[Any]:
    """Have iterates of a solver corrected for a while, if it takes full steps."""
    damped = getattr(solver, "relaxation_parameter", 1.0) != 1.0
    if damped or not takes_full_steps(solver):
        return nullcontext()
    return temporarily(solver, on_iterate=Corrections(solver))
