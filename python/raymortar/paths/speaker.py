"""Lines on a step that takes long, while it is solved."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from time import monotonic

from ..core.problem import CoupledProblem
from ..diagnose.holding import largest_motions
from ..records.output import Progress
from ..solvers.settings import temporarily

# Seconds from one line to the next
EVERY = 10.0


class Speaker:
    """Says every 10 s how far the solve of a step is: the way, its iteration, what is out
    of balance, and the body that has moved most. Collective.

    `way` tells the name of the way that solves at present. Rank 0's clock decides, so
    that all ranks speak at the same iterate.
    """

    def __init__(
        self, problem: CoupledProblem, progress: Progress, way: Callable[[], str]
    ) -> None:
        self._problem, self._progress, self._way = problem, progress, way
        self._last, self._step, self._solve = 0.0, -1, -1
        self._begun = self._solve_begun = 0  # tangents by then

    def during(self) -> AbstractContextManager[None]:
        """Speak in the solves of a step, where lines are shown."""
        if not self._progress.shown:
            return nullcontext()
        if self._step != self._problem.steps_accepted:  # no halved one
            self._step = self._problem.steps_accepted
            self._last, self._begun = monotonic(), self._problem.tangents
        return temporarily(self._problem.convergence, watcher=self._look)

    def _look(self) -> None:
        """Speak at this iterate if it is time."""
        problem, now = self._problem, monotonic()
        if self._solve != problem.solves:
            self._solve, self._solve_begun = problem.solves, problem.tangents
        if not problem.comm.bcast(now - self._last >= EVERY):
            return
        self._last = now
        count = problem.tangents
        self._progress.working(
            f"{self._way()}: tangents {count - self._begun}, iteration "
            f"{count - self._solve_begun}, residual "
            f"{problem.convergence.now.norm:.2e}{self._moved()}"
        )

    def _moved(self) -> str:
        """Say which body has moved most since the accepted step, if any has."""
        problem = self._problem
        motions = largest_motions(problem.contact, problem.contact.states.u_old)
        names = problem.convergence.groups.names()
        body = int(motions.argmax())
        if not motions[body] > 0.0:
            return ""
        return f", {names[body]} has moved by {motions[body]:.2e}"
