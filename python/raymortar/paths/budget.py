"""Budgets of tangents, for ways that may go on without getting anywhere."""

from __future__ import annotations

import numpy as np

from ..core.problem import CoupledProblem

# Tangents that a way may take without a gain, and the factor of what it makes small that
# counts as one
MOST_IDLE, GAIN = 60, 0.5


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
