"""Soft start: solves with a small coefficient first where bodies bend."""

from __future__ import annotations

import warnings
from typing import Any

from ..errors import ContactWarning

# Largest ratio of the soft coefficient to the one in use: with more, nothing is gained
# (docs/measured/slip_fronts.md)
BENDS = 0.015

# Iterations of a step above which it is worth to find what the bodies yield
MANY = 8

# Relative tolerance of the first solve, whose solution is a start
ROUGH = 1e-3


class SoftStart:
    """Starts solves from a rough solution with the coefficient of what surfaces yield.

    Where bodies bend, the coefficient (5.2) of a law at points is up to 1e3 times that
    of (5.16), and hundreds of points change their status in a solve. With (5.16) few
    points do. From its solution a solve with the coefficient in use needs two to five
    iterations, and only that second solution is kept. Where bodies do not bend, there is
    no soft start. Collective.
    """

    def __init__(self, problem: Any) -> None:
        contact = problem.contact
        coupled = zip(contact.contacts, contact.softer(problem.bcs))
        self._softer = [
            (one, gamma)
            for (one, gamma), part in zip(coupled, contact.parts)
            if gamma is not None and _largest(gamma) < BENDS * part.gamma_scale
        ]

    def __bool__(self) -> bool:
        return bool(self._softer)

    def solve(self, solver: Any) -> int:
        """Solve roughly from the present state; return the iterations. Collective."""
        given = [one.gamma for one, _ in self._softer]
        tolerances = solver.tolerances
        solver.tolerances = max(ROUGH, tolerances[0]), tolerances[1]
        try:
            for one, gamma in self._softer:
                one.set_gamma(gamma)
            # Its state is not kept, and warnings of it are of no interest
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ContactWarning)
                return int(solver.solve()[0])
        finally:
            solver.tolerances = tolerances
            for (one, _), gamma in zip(self._softer, given):
                one.set_gamma(gamma)


def _largest(gamma: Any) -> float:
    """Largest value of a number or of coefficients by pair."""
    tables = getattr(gamma, "tables", None)
    return float(gamma) if tables is None else max(float(t.max()) for t in tables)
