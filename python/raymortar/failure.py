"""What to say of a solve that did not converge: what was seen, and what to try."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from petsc4py import PETSc

from .errors import ContactError, ConvergenceError
from .trouble import cycle_length

# What another way, or a smaller step, may cure
FAILURES = (ConvergenceError, ContactError, PETSc.Error)

# Residuals at either end of a history that a message lists
_ENDS = 5

_REASONS = {
    "DIVERGED_FUNCTION_DOMAIN": "the residual has no value there",
    "DIVERGED_FUNCTION_COUNT": "too many residuals were asked for",
    "DIVERGED_LINEAR_SOLVE": "the linear solver failed",
    "DIVERGED_MAX_IT": "the largest number of iterations was reached",
    "DIVERGED_LINE_SEARCH": "the line search found no smaller residual",
    "DIVERGED_INNER": "an inner solve failed",
    "DIVERGED_LOCAL_MIN": "the same residuals come again and again",
    "DIVERGED_DTOL": "the residual grew beyond the divergence tolerance",
    "DIVERGED_JACOBIAN_DOMAIN": "the tangent has no value there",
    "DIVERGED_TR_DELTA": "the trust region became too small",
}
# Relative difference of residuals that a message calls the same
_ALIKE = 0.02
# Its name in petsc4py has changed
NOT_A_NUMBER = -4


def reason_in_words(reason: int) -> str:
    """PETSc's reason for the end of a nonlinear solve."""
    if reason == NOT_A_NUMBER:
        return f"SNES reason {reason}: the residual is no number"
    for name in _REASONS:
        if getattr(PETSc.SNES.ConvergedReason, name, None) == reason:
            return f"SNES reason {reason}: {_REASONS[name]}"
    return f"SNES reason {reason}"


def list_of_residuals(history: Sequence[float]) -> str:
    """Norms, of a long history those at both ends."""
    texts = [f"{r:.3e}" for r in history]
    left_out = len(texts) - 2 * _ENDS
    if left_out > 0:
        texts[_ENDS:-_ENDS] = [f"({left_out} more)"]
    return ", ".join(texts)


def describe_failure(
    history: Sequence[float],
    statistics: Any,
    unheld: Sequence[str],
    imbalance: str,
    rigid: Sequence[int] = (),
) -> str:
    """State of contact, residuals, and what to try by what they show.

    Parameters
    ----------
    history
        Norms of the residuals. Force.
    statistics
        Of the contact.
    unheld
        Sentences on bodies that are held by nothing.
    imbalance
        Of `Convergence.describe`.
    rigid
        Slave tags that are prescribed throughout, on masters that are not.
    """
    text = f"{statistics}; residual history: {list_of_residuals(history)}"
    period = cycle_length(history, _ALIKE)
    if period:
        text += (
            f"; it repeats every {period} residuals: points open and close, or stick and "
            "slip, in turn"
        )
    advice = _advice(history, statistics, unheld, period)
    if rigid and not unheld:
        tags = ", ".join(map(str, rigid))
        advice = f"the other body as the slave: all of slave tag {tags} is prescribed"
    text = "; ".join([text + imbalance, *unheld])
    return text + (f". Try {advice}" if advice else "")


def _advice(
    history: Sequence[float], statistics: Any, unheld: Sequence[str], period: int
) -> str:
    """What to try first, empty where nothing particular was seen."""
    if unheld:
        return (
            "a condition that holds it, a start where it touches, or "
            "LoadSteps(stabilize=True)"
        )
    if not statistics.hits:
        return "a larger reach in Search, if the bodies should touch"
    if period:
        return (
            "LoadSteps, which tries other ways; a tenth of gamma "
            "(contact.set_gamma(0.1 * contact.gamma)); with degree 2 and friction also "
            "AugmentedLagrangian(degree=1)"
        )
    norms = np.array(history)
    if len(norms) and (
        not np.isfinite(norms).all() or norms[-1] > 10.0 * max(norms[0], norms.min())
    ):
        return "smaller steps"
    return ""
