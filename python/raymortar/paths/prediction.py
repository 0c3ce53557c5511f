"""Start of a step: the last accepted state, or the place where the last step leads."""

from __future__ import annotations

from typing import Any

from ..interface.state import State
from .load_path import PrescribedPath

# Share of displacements that is rounding error
ROUNDING = 1e-10


class Prediction:
    """Extrapolates a state by the change of the last step, where that leads on.

    The forces tell of a path that turns round, or touches: fewer of them must be out
    of balance where the last step leads than where it ended, and prescribed
    displacements nearer. A start that fails is left out for 1, 2, 4, 8 steps; those that
    the user asks for are `always` taken.
    """

    def __init__(self, path: PrescribedPath, always: bool = False) -> None:
        self._path, self._problem, self.always = path, path.solver.problem, always
        self._backoff = Backoff()

    def leads_on(self, now: State, last: State, ratio: float) -> bool:
        """Go where the last step leads; False: stay at the present state. Collective."""
        if not self.always and self._backoff.rests():
            return False
        here = 0.0 if self.always else self._imbalance()
        pending = self._problem.convergence.now.pending
        self._path.extrapolate(ratio)
        self._problem.contact.extrapolate(now, last, ratio)
        if self.always or (self._imbalance() < here and self._is_nearer(pending)):
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

    def _is_nearer(self, pending: float) -> bool:
        """Whether prescribed displacements lack less than they did, or nothing."""
        now = self._problem.convergence.now
        lack, size = now.pending, now.sizes[0]
        return bool(lack < pending or lack <= ROUNDING * size)

    def _imbalance(self) -> float:
        """Sum up what is out of balance at the present state. Force. Collective."""
        problem: Any = self._problem
        x, b = problem.start(), problem.create_vector()
        try:
            problem.F(x, b)
            size: float = problem.convergence.now.norm
        finally:
            x.destroy()
            b.destroy()
        return size


# Most steps for which it is left out
LONGEST = 8


class Backoff:
    """Leaves something out for 1, 2, 4, 8 steps, longer after each failure."""

    def __init__(self) -> None:
        self._length = self._left = 0

    def rests(self) -> bool:
        """Tell whether this step leaves it out, and count the step."""
        rests = self._left > 0
        self._left -= rests
        return rests

    def failed(self) -> None:
        """Note a failure."""
        self._length = min(max(1, 2 * self._length), LONGEST)
        self._left = self._length

    def reset(self) -> None:
        """Forget all failures."""
        self._length = self._left = 0
