"""Messages for a solve that did not converge: what was seen, and what to try."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import compat
from ..convergence.trouble import cycle_length
from ..errors import ContactError, ConvergenceError
from ..problem import CoupledProblem

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


@dataclass(frozen=True)
class InUse:
    """How a solve is used, so that messages give advice that fits.

    Attributes
    ----------
    steps
        Whether the solve is a step of `LoadSteps`.
    automatic
        Whether `LoadSteps` tries other ways.
    controlled
        Whether the load factor is an unknown.
    may_be_viscous
        Whether viscous forces are possible and not yet used.
    degree
        Largest degree of a multiplier.
    led
        Weights of the owned dofs of u in the controlled displacement, or None.
    """

    steps: bool = False
    automatic: bool = False
    controlled: bool = False
    may_be_viscous: bool = True
    degree: int = 2
    led: Any = None


def in_use_of(problem: CoupledProblem) -> InUse:
    """How solves of a problem are used at present."""
    multipliers = [one.multiplier for one in problem.contact.contacts]
    degrees = [
        compat.element_info(multiplier.function_space).degree
        for multiplier in multipliers
        if multiplier is not None
    ]
    alone: dict[str, Any] = {
        "may_be_viscous": len(problem.contact.host.displacements) == 1,
        "degree": max(degrees, default=0),
    }
    return InUse(**{**alone, **problem.part_of})


def reason_in_words(reason: int) -> str:
    """PETSc's reason for the end of a nonlinear solve."""
    if reason == NOT_A_NUMBER:
        return f"SNES reason {reason}: the residual is no number"
    for name in _REASONS:
        if getattr(PETSc.SNES.ConvergedReason, name, None) == reason:
            return f"SNES reason {reason}: {_REASONS[name]}"
    return f"SNES reason {reason}"


def list_of_residuals(history: Sequence[float]) -> str:
    """Norms as text; of a long history the first and the last ones."""
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
    swaps: Sequence[str] = (),
    excess: Sequence[str] = (),
    gammas: Sequence[str] = (),
    in_use: InUse = InUse(),
) -> str:
    """State of contact, residuals, and what to try.

    Parameters
    ----------
    history
        Norms of the residuals. Force.
    statistics
        Of the contact.
    unheld
        Sentences on bodies that nothing holds.
    imbalance
        Of `Convergence.describe`.
    rigid
        Tags of slaves whose displacement is prescribed throughout, on masters that
        move.
    swaps
        Proposals for slaves that are too fine for their masters.
    excess
        Sentences on interferences that are larger than the bodies are thick.
    gammas
        Of `strange_gamma.strange_gammas`.
    in_use
        How the solve is used.
    """
    text = f"{statistics}; residual history: {list_of_residuals(history)}"
    period = cycle_length(history, _ALIKE)
    if period:
        text += (
            f"; it repeats every {period} residuals: points open and close, or stick and "
            "slip, in turn"
        )
    if unheld:
        proposals = ways_to_hold(in_use)
    elif rigid:
        tags = ", ".join(map(str, rigid))
        proposals = [
            f"the other body as the slave: all of slave tag {tags} is prescribed"
        ]
    elif excess:
        proposals = ["a smaller interference"]
    else:
        proposals = _proposals(history, statistics, period, swaps, in_use)
    text = "; ".join([text + imbalance, *unheld, *excess, *gammas])
    return text + (f". Try {one_of(proposals)}" if proposals else "")


def one_of(proposals: Sequence[str]) -> str:
    """Proposals as a list in words."""
    *others, last = proposals
    return f"{', '.join(others)}, or {last}" if others else last


def ways_to_hold(in_use: InUse) -> list[str]:
    """What to try where nothing holds a body."""
    viscous = ["LoadSteps(stabilize=True)"] * in_use.may_be_viscous
    return ["a condition that holds it", "a start where it touches", *viscous]


def _proposals(
    history: Sequence[float],
    statistics: Any,
    period: int,
    swaps: Sequence[str],
    in_use: InUse,
) -> list[str]:
    """What to try first; empty if the residuals show no particular fault."""
    norms = np.array(history)
    diverged = bool(len(norms)) and bool(
        not np.isfinite(norms).all() or norms[-1] > 10.0 * max(norms[0], norms.min())
    )
    if not statistics.hits and not diverged:
        return ["a larger reach in Search, if the bodies should touch"]
    found = list(swaps)
    if period:
        found += _against_cycles(in_use)
    elif diverged:
        found.append("smaller steps")
    return found


def _against_cycles(in_use: InUse) -> list[str]:
    """What to try where residuals repeat."""
    found = []
    if not in_use.steps:
        found.append("LoadSteps, which tries other ways")
    elif not in_use.automatic:
        found.append('LoadSteps(strategy="auto"), which tries other ways')
    found.append("a tenth of gamma (contact.set_gamma(0.1 * contact.gamma))")
    if in_use.degree > 1:
        found.append("AugmentedLagrangian(degree=1) where degree 2 meets friction")
    if not in_use.controlled:
        found.append('snes_linesearch_type "bt" in SNESSolver')
    return found
