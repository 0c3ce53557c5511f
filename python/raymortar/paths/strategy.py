"""A way to solve one load step, and the failures that another one may cure."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from ..core.errors import ConvergenceError, SetUpError
from ..core.problem import CoupledProblem
from ..diagnose.trouble import is_in_trouble

FULL, EXTRAPOLATED, SOFT = "full", "extrapolated", "soft start"
SMALL_GAMMA, VISCOUS = "small gamma, line search", "viscous forces"
PARTIAL = "partial steps"
# A state remembers a way by its place: a new one goes to the end
WAYS = (FULL, EXTRAPOLATED, SOFT, SMALL_GAMMA, VISCOUS, PARTIAL)


class Strategy(Protocol):
    """A way to solve a step that the solver as it was given may not solve.

    `Strategies` has a list of them. All methods but `remember` are collective. Nothing
    that a way keeps may refer to that list: in a cycle of references, ranks would free
    a solver at different times.
    """

    name: str

    @abstractmethod
    def solve(self, first: bool) -> int | None:
        """Solve from the present state, before the solver as it was given or after it;
        return the iterations, None where the way does not work."""

    def goes_first(self) -> bool:
        """Tell whether it goes before the solver as it was given."""
        return False

    def is_of_use(self) -> bool:
        """Tell whether it may help where that solver has failed."""
        return True

    def accepted(self) -> None:
        """Note that a step is accepted."""
        return None

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on, always as many."""
        return []

    def recall(self, numbers: Iterator[float]) -> None:
        """Go on from numbers: take as many as `remember` gives."""
        return None


def is_curable(failure: Exception, solver: Any, is_smallest: bool) -> bool:
    """Whether a solve cycled or diverged, or a line search found no descent, rather
    than that iterations ran out; or whether these did in the smallest step, where
    halving has not helped."""
    if isinstance(failure, SetUpError):
        return False
    if not isinstance(failure, ConvergenceError):
        return True
    problem = solver.problem
    norms = problem.convergence.norms
    ran_out = len(norms) > getattr(solver, "max_it", np.inf)
    found_none = getattr(solver, "finds_no_descent", False)
    if problem.convergence.jumped or is_in_trouble(norms):
        return True
    return is_broken(problem) or (ran_out and is_smallest) or found_none


def is_broken(problem: CoupledProblem) -> bool:
    """Whether the last solve ended at forces that are no numbers, as where cells turn
    inside out."""
    # PETSc stops there without asking our test of convergence
    return bool(problem.history) and not np.isfinite(problem.history[-1])
