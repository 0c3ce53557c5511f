"""Corrections of Newton's iterates by the factors of their last tangent."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..core.convergence.convergence import Imbalance
from ..core.discretization.ranks import destroy
from ..core.solvers.newton import NewtonSolver, SNESSolver
from ..diagnose.failure import FAILURES
from .lagging_factors import LaggedFactorsSolver
from .settings import is_limited, temporarily
from .statuses_ahead import StatusesAhead

LINE_SEARCH = "snes_linesearch_type"

# Largest shares of the residual that an iteration leaves whose iterate is corrected, and
# that a correction leaves after which another one follows
ITERATION_LEAVES, LEAVES = 0.2, 0.7

# Share of the tolerances at which corrections end. They converge more slowly than
# Newton's method, which mostly ends far below the tolerances, and would end right below
SURPLUS = 1e-4


class Corrections:
    """Corrects an iterate by the tangent that led to it, up to a solution. Collective.

    A correction takes a residual and a solve with factors that exist, which is less than
    an iteration. Each of them updates the tangent. An iterate is corrected if its
    iteration has left a small share of the residual, and as long as each correction
    does [theory (5.26)]. If corrections do not end at a solution, the iterate is
    restored: a path has the iterates of Newton's method but for the last ones of a step.
    """

    def __init__(self, solver: Any) -> None:
        self._solver, self._problem = solver, solver.problem
        self._convergence = solver.problem.convergence

    def __call__(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Correct an iterate, and b, its residual."""
        convergence, history = self._convergence, self._problem.history
        now, recent = convergence.now, convergence.recent
        # The norm contains forces only: a temperature may diverge while it falls
        if recent[1] is None or len(now.residual) > now.count:
            return
        if now.norm > ITERATION_LEAVES * float(np.linalg.norm(recent[1])):
            return
        convergence.recent = recent[1], now.residual
        if not self._has_ended(1.0):
            count = len(history)
            now, recent = self._best(x, b, now, recent)
            # Each iterate is in the history once
            history[count - 1 :] = [now.norm]
        convergence.now, convergence.recent = now, recent

    def _best(
        self, x: PETSc.Vec, b: PETSc.Vec, now: Imbalance, recent: Any
    ) -> tuple[Imbalance, Any]:
        """Correct up to a solution, or restore the iterate; return its imbalance, and the
        residuals of the last two iterates."""
        convergence, best = self._convergence, (x.copy(), b.copy())
        steps: list[PETSc.Vec] = []
        is_best, goes_on = True, True
        try:
            with suppress(*FAILURES):
                while goes_on:
                    is_best = False
                    goes_on = self._corrects(x, b, steps)
                    if self._has_ended(1.0):
                        is_best = True
                        now, recent = convergence.now, convergence.recent
                        x.copy(best[0])
                        b.copy(best[1])
                        goes_on = goes_on and not self._has_ended(SURPLUS)
            if not is_best:
                best[0].copy(x)
                best[1].copy(b)
                self._problem.form(x)
        finally:
            destroy(*best, *steps)
        return now, recent

    def _has_ended(self, share: float) -> bool:
        """Whether the iterate is a solution to a share of the tolerances, or down to
        rounding, or is not yet where it is prescribed."""
        convergence, solver = self._convergence, self._solver
        rtol, atol = share * solver.tolerances[0], solver.force_tolerance
        if convergence.is_pending(rtol):
            return True
        atol = atol if atol is None else share * atol
        return bool(convergence.reached(rtol, atol, at_once=share < 1.0))

    def _corrects(self, x: PETSc.Vec, b: PETSc.Vec, steps: list[PETSc.Vec]) -> bool:
        """Correct once, and add the step to those before; return whether that has left
        a small share of the residual."""
        convergence, step = self._convergence, b.duplicate()
        before = convergence.now
        steps.append(step)
        self._solver.krylov_solver.solve(b, step)
        step.scale(-1.0)
        update(step, steps[:-1])
        x.axpy(1.0, step)
        self._problem.F(x, b)
        if self._solver.scale is not None:
            b.pointwiseMult(b, self._solver.scale)
        convergence.recent = before.residual, convergence.now.residual
        return bool(convergence.now.norm <= LEAVES * before.norm)


def update(step: PETSc.Vec, before: Sequence[PETSc.Vec]) -> None:
    """Turn a step by the first tangent into one by the tangent that all steps before
    have updated. Collective.

    Broyden's update [theory (5.27)], as C. T. Kelley has it in *Iterative Methods for
    Linear and Nonlinear Equations* (1995), 7.3. Unknowns of contact are lengths, and so
    is what the products compare.
    """
    for one, after in zip(before, before[1:]):
        step.axpy(one.dot(step) / one.dot(one), after)
    if before:
        last = before[-1]
        share = last.dot(step) / last.dot(last)
        if share < 1.0:  # or the updated tangent is singular
            step.scale(1.0 / (1.0 - share))


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


@contextmanager
def _with(
    solver: Any, ahead: StatusesAhead, corrections: Corrections
) -> Iterator[None]:
    """Have iterates of a solver changed and corrected."""
    if not (ahead and takes_full_steps(solver)):
        with temporarily(solver, on_iterate=corrections):
            yield
        return

    def iterate(x: PETSc.Vec, b: PETSc.Vec) -> None:
        ahead(x, b)
        corrections(x, b)
        ahead.keep(x)

    try:
        with temporarily(solver, on_iterate=iterate):
            yield
    finally:
        ahead.destroy()


def correcting(
    given: Any, acting: SNESSolver | None = None
) -> AbstractContextManager[Any]:
    """Have iterates corrected for a while, if that may save time: the solver that the
    user has given takes full steps without a limit of the user's, and factorises
    tangents.

    Iterates of `acting` are corrected, if it solves in place of the given one.
    """
    solver = acting or given
    is_watched = getattr(solver, "on_iterate", None) is not None
    damped = getattr(given, "relaxation_parameter", 1.0) != 1.0
    if is_limited(given) or is_watched or damped or not takes_full_steps(given):
        return nullcontext()
    if not has_own_factors(solver.krylov_solver):
        return nullcontext()
    return _with(solver, StatusesAhead(solver), Corrections(solver))
