"""The end of a solve by PETSc's SNES."""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

import numpy as np

from ..problem import CoupledProblem
from .petsc_objects import NOT_A_NUMBER

STUCK = PETSc.SNES.ConvergedReason.DIVERGED_LOCAL_MIN


def convergence_test(
    problem_of: Callable[[], CoupledProblem],
    corrected: Callable[[], Callable[[], bool] | None],
    snes: PETSc.SNES,
    floor: float,
) -> Callable[..., int]:
    """Convergence test for a SNES whose options are in PETSc's table.

    It compares forces with forces. PETSc's own test compares the norm of all rows with
    that of the first iterate, which lacks the forces that a body meets on its way. If
    the user sets a divergence tolerance, it is relative to the first residual above
    rounding error.
    """
    reasons = PETSc.SNES.ConvergedReason
    options = PETSc.Options(snes.getOptionsPrefix())
    divergence = options.getReal("snes_divergence_tolerance", -1.0)

    def test(snes: PETSc.SNES, iteration: int, norms: tuple[float, ...]) -> int:
        size, step, norm = norms
        rtol, given, stol, _ = snes.getTolerances()
        atol = None if given == floor else given
        convergence, history = problem_of().convergence, problem_of().history
        correct = corrected()
        valid = np.isfinite(norm) and (correct is None or correct())
        convergence.accept()
        if not valid:
            return NOT_A_NUMBER
        if convergence.reached(rtol, atol):
            return reasons.CONVERGED_FNORM_RELATIVE
        first = next((norm for norm in history if norm > convergence.floor), 0.0)
        if 0.0 < divergence * first < history[-1]:
            return reasons.DIVERGED_DTOL
        if convergence.is_stuck:
            return STUCK
        if iteration > 0 and step < stol * size and not convergence.now.pending:
            return reasons.CONVERGED_SNORM_RELATIVE
        if 0 <= snes.getMaxFunctionEvaluations() <= snes.getFunctionEvaluations():
            return reasons.DIVERGED_FUNCTION_COUNT
        return reasons.CONVERGED_ITERATING

    return test
