"""Start of a step: the last accepted state, or the place where the last step leads."""

from __future__ import annotations

from typing import Any

from ..interface.state import State
from .backoff import Backoff
from .load_path import PrescribedPath


class Prediction:
    """Extrapolates a state by the change of the last step, where that leads on.

    The forces tell of a path that turns round, or touches: fewer of them must be out
    of balance where the last step leads than where it ended. A start that fails is
    left out for 1, 2, 4, 8 steps; those that the user asks
    for are `always` taken.
    """

    def __init__(self, path: PrescribedPath, always: bool = False) -> None:
        self._path, self._problem, self.always = path, path.solver.problem, always
        self._backoff = Backoff()

    def leads_on(self, now: State, last: State, ratio: float) -> bool:
        """Go where the last step leads; False: stay at the present state. Collective."""
        if not self.always and self._backoff.rests():
            return False
        here = (0.0, 0.0) if self.always else self._imbalance()
        self._path.extrapolate(ratio)
        self._problem.contact.extrapolate(now, last, ratio)
        if self.always or self._is_nearer(*here):
            return True
        self._problem.contact.restore(now)
        self._path.restart()
        return False

    def note(self, works: bool) -> None:
        """Note whether a solve from there converged."""
        if works:
            self._backoff.reset()
        else:
            self._backoff.failed()

    def _is_nearer(self, forces: float, pending: float) -> bool:
        """Whether less is out of balance than elsewhere, and prescribed displacements
        are nearer: else the path turns. Collective."""
        now, left = self._imbalance()
        return now < forces and (left < pending or pending == 0.0)

    def _imbalance(self) -> tuple[float, float]:
        """Sum up what is out of balance at the present state, and find how far the
        prescribed displacements are. Force, length. Collective."""
        problem: Any = self._problem
        x, b = problem.start(), problem.create_vector()
        try:
            problem.F(x, b)
            now = problem.convergence.now
        finally:
            x.destroy()
            b.destroy()
        return float(now.norm), float(now.pending)
