"""Where a step starts: at the last accepted state, or where the last step leads."""

from __future__ import annotations

from typing import Any

from ..interface.state import State
from .load_path import PrescribedPath

# Most steps for which something that fails again and again is left out
LONGEST = 8


class Backoff:
    """Leaves out what has failed: for 1, 2, 4, ... steps, until it works again."""

    def __init__(self) -> None:
        self._length = self._left = 0

    def rests(self) -> bool:
        """Whether this step leaves it out."""
        self._left -= 1
        return self._left >= 0

    def failed(self) -> None:
        """Note a failure."""
        self._length = min(max(1, 2 * self._length), LONGEST)
        self._left = self._length

    def worked(self) -> None:
        """Note that it works."""
        self._length = self._left = 0


class Prediction:
    """Extrapolates a state by the change of the last step, where that leads on.

    A path that turns round, or touches, is told from the forces that are out of balance:
    they must be smaller where the last step leads than where it ended.

    Parameters
    ----------
    path
        Path of the steps, after `begin`.
    always
        Whether the extrapolated state is taken without asking.
    """

    def __init__(self, path: PrescribedPath, always: bool) -> None:
        self._path, self._problem = path, path.solver.problem
        self._always, self.trust = always, Backoff()

    def take(self, now: State, last: State, ratio: float) -> bool:
        """Go where the last step leads; False: stay at the present state. Collective."""
        if self.trust.rests() and not self._always:
            return False
        here = 0.0 if self._always else self._imbalance()
        self._path.extrapolate(ratio)
        self._problem.contact.extrapolate(now, last, ratio)
        if self._always or self._imbalance() < here:
            return True
        self._problem.contact.restore(now)
        self._path.restart()
        return False

    def _imbalance(self) -> float:
        """Forces that are out of balance at the present state. Collective."""
        problem: Any = self._problem
        x, b = problem.start(), problem.create_vector()
        try:
            problem.F(x, b)
            size: float = problem.convergence.now.norm
        finally:
            x.destroy()
            b.destroy()
        return size
