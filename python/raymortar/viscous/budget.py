"""Budgets of tangents and of steps, for ways that may not get anywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.problem import CoupledProblem

# Tangents that a way may take without a gain, and the factor of what it makes small that
# counts as one
MOST_IDLE, GAIN = 60, 0.5
# Most steps for which something is left out
LONGEST = 8


class Budget:
    """Tangents of a way since something that it makes small was last halved."""

    def __init__(self, problem: CoupledProblem) -> None:
        self._problem = problem
        self.begin()

    def begin(self) -> None:
        """Begin anew."""
        self._least, self._begun = np.inf, self._problem.tangents

    def note(self, size: float) -> None:
        """Note the present size of what the way makes small."""
        if size <= GAIN * self._least:
            self._least, self._begun = size, self._problem.tangents

    @property
    def is_spent(self) -> bool:
        """Whether there has been no gain for too long."""
        return self._problem.tangents - self._begun >= MOST_IDLE


class Backoff:
    """Leaves something out for 1, 2, 4, 8 steps, longer after each failure."""

    def __init__(self) -> None:
        self._length = self._left = 0

    def rests(self) -> bool:
        """Tell whether this step leaves it out, and count the step."""
        rests = self._left > 0
        self._left -= rests
        return rests

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        return [self._length, self._left]

    def recall(self, numbers: Sequence[float]) -> None:
        """Go on from numbers."""
        self._length, self._left = map(int, numbers)

    def failed(self) -> None:
        """Note a failure."""
        self._length = min(max(1, 2 * self._length), LONGEST)
        self._left = self._length

    def reset(self) -> None:
        """Forget all failures."""
        self._length = self._left = 0
