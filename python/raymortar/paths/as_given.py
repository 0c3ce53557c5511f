"""The solver as it was given: from where the last step leads, and for longer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack

from ..core.solvers.solver import MAX_IT
from ..core.state import State
from ..diagnose.failure import FAILURES
from ..solvers.settings import is_limited, temporarily
from .load_path import PrescribedPath
from .prediction import Prediction
from .soft_start import MORE_ITERATIONS, PlainSolver


class AsGiven:
    """Solves a step by the solver as it was given. Collective.

    `is_ahead` tells whether the last step was solved from a start that the user asked
    for.
    """

    def __init__(
        self, path: PrescribedPath, extrapolates: bool | None, automatic: bool
    ) -> None:
        self._path, self._solver, self._automatic = path, path.solver, automatic
        goes_ahead = extrapolates or (extrapolates is None and path.led is None)
        self._prediction = Prediction(path, bool(extrapolates)) if goes_ahead else None
        self.plain = PlainSolver(self._solver, automatic)
        self.is_ahead = False

    def solve(
        self, now: State, last: State | None, ratio: float, goes_on: bool
    ) -> int | None:
        """Solve from where the last step leads, if the path goes on from there; return
        None if that fails, at a state that is to be restored."""
        prediction, self.is_ahead = self._prediction, False
        if prediction and last is not None and (prediction.always or goes_on):
            if prediction.leads_on(now, last, ratio):
                return self._from_ahead(prediction)
        return self.from_here()

    def from_here(self) -> int:
        """Solve from the accepted state."""
        # A predicted start has the slip of the last step, and the nodes that have closed;
        # this one has to find them
        return self.plain.solve(opens=True)

    def _from_ahead(self, prediction: Prediction) -> int | None:
        iterations = None
        with temporarily(self._solver.problem.convergence, patient=False):
            try:
                iterations = self.plain.solve()
                self.is_ahead = prediction.always
            except FAILURES:
                pass
        prediction.note(iterations is not None)
        return iterations

    def more_iterations(self) -> AbstractContextManager[object]:
        """Let solves go on for longer while they are not in trouble, unless the user has
        limited them: in a halved step active sets are as far away as before."""
        solver, found = self._solver, ExitStack()
        if self._automatic and not is_limited(solver):
            most, convergence = MORE_ITERATIONS * MAX_IT, solver.problem.convergence
            found.enter_context(temporarily(convergence, lasts=True))
            found.enter_context(temporarily(solver, max_it=most))
        return found

    def accepted(self, begin: State, jumps: bool) -> None:
        """Note that the step is accepted which began at a state."""
        if self._prediction:
            self._prediction.accepted(begin, jumps)

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        ahead = self._prediction.remember() if self._prediction else ()
        return [*self.plain.remember(), *ahead]

    def recall(self, numbers: Iterator[float], starts: Sequence[State]) -> None:
        """Go on from all numbers that are left, and the starts of the last steps."""
        self.plain.recall([next(numbers) for _ in self.plain.remember()])
        if self._prediction:
            self._prediction.recall([*numbers] or (0, 0), starts)
