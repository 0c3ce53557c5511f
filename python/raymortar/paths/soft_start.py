"""Soft coefficients of laws at points where bodies bend, for a start or for a path."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from ..errors import ContactWarning

# Largest ratio of the soft coefficient to the one in use: with more, nothing is gained
# (docs/measured/slip_fronts.md)
BENDS = 0.015

# Ratio below which the soft coefficient stays for the path: results change by less
# (docs/measured/slip_fronts.md)
STAYS = 0.003

# Iterations of a step above which it is worth to find what the bodies yield
MANY = 8

# Relative tolerance of a first solve, whose solution is a start
ROUGH = 1e-3


class SoftStart:
    """Solves with the coefficient of what surfaces yield.

    Where bodies bend, the coefficient (5.2) of a law at points is up to 1e3 times that
    of (5.16), and hundreds of points change their status in a solve. With (5.16) few
    points do. Where the automatic (5.2) is 500 times (5.16), the path keeps (5.16) until
    its end. Else it solves from a rough solution with it, which takes two to five
    iterations, and only the second solution is kept. Where bodies do not bend, there is
    neither. Collective.
    """

    def __init__(self, problem: Any) -> None:
        contact = problem.contact
        self._softer: list[tuple[Any, Any]] = []
        self._stays: list[tuple[Any, Any]] = []
        self.numbers: set[int] = set()
        """Numbers of the parts whose coefficient is soft at the moment."""
        for one, gamma in zip(contact.contacts, contact.softer(problem.bcs)):
            if gamma is None:
                continue
            part = one.assembly
            ratio = _largest(gamma) / part.gamma_scale
            if ratio < STAYS and one.gamma is part.automatic_gamma:
                self._stays.append((one, gamma))
            elif ratio < BENDS:
                self._softer.append((one, gamma))

    def __bool__(self) -> bool:
        return bool(self._softer)

    @property
    def stays(self) -> bool:
        """Whether a coefficient is to be soft for the rest of the path."""
        return bool(self._stays)

    def stay(self) -> None:
        """Make the coefficients soft that stay so. Collective."""
        self._soften(self._stays)

    def _soften(self, contacts: list[tuple[Any, Any]]) -> None:
        for one, gamma in contacts:
            one.set_gamma(gamma)
            self.numbers.add(one.assembly.number)

    def solve(
        self,
        solver: Any,
        softening: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> int:
        """Solve roughly from the present state, within what `softening` makes; return
        the iterations. Collective."""
        given, kept = [one.gamma for one, _ in self._softer], set(self.numbers)
        try:
            self._soften(self._softer)
            with softening():
                return solve_roughly(solver)
        finally:
            self.numbers = kept
            for (one, _), gamma in zip(self._softer, given):
                one.set_gamma(gamma)


def solve_roughly(solver: Any) -> int:
    """Solve for a state to start from; return the iterations. Collective."""
    tolerances = solver.tolerances
    solver.tolerances = max(ROUGH, tolerances[0]), tolerances[1]
    try:
        # The state is not kept, and warnings of it are of no interest
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            return int(solver.solve()[0])
    finally:
        solver.tolerances = tolerances


def _largest(gamma: Any) -> float:
    """Largest value of a number or of coefficients by pair."""
    tables = getattr(gamma, "tables", None)
    return float(gamma) if tables is None else max(float(t.max()) for t in tables)
