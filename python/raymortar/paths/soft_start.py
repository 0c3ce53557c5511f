"""Soft coefficients of laws at points where bodies bend, for a start or for good."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from ..diagnose.failure import FAILURES
from ..errors import ContactWarning

# Largest ratio of the soft coefficient to the one in use: with more, nothing is gained
# (docs/measured/slip_fronts.md)
BENDS = 0.015

# Iterations of a solve above which another coefficient is worth its while, and number of
# such steps in a row
MANY, IN_A_ROW = 8, 2

# Relative tolerance of a first solve, whose solution is a start
ROUGH = 1e-3


class SoftStart:
    """Solves with the coefficient of what surfaces yield.

    Where bodies bend, the coefficient (5.2) of a law at points is up to 1e3 times that
    of (5.16), and hundreds of points change their status in a solve. With (5.16) few
    points do. A solve starts from a rough solution with it, goes on with the one in use,
    and only the second solution is kept. Where the second solve fails or takes long, an
    automatic coefficient gives way to (5.16) for good. Where bodies do not bend, there is
    no soft start. Collective.
    """

    def __init__(self, problem: Any) -> None:
        self._softer = [
            (one, gamma)
            for one, gamma in _that_bend(problem)
            if not one.assembly.gamma_is_soft
        ]

    def __bool__(self) -> bool:
        return bool(self._softer)

    @property
    def may_stay(self) -> bool:
        """Whether a soft coefficient may take the place of an automatic one in use."""
        return any(map(_is_automatic, self._softer))

    def stay(self) -> list[tuple[Any, Any]]:
        """Put soft coefficients in the place of automatic ones; return what `undo`
        takes. Collective."""
        changed = list(filter(_is_automatic, self._softer))
        _soften(changed)
        self._softer = [pair for pair in self._softer if pair not in changed]
        return changed

    def undo(self, changed: list[tuple[Any, Any]]) -> None:
        """Take back the automatic coefficients. Collective."""
        for one, _ in changed:
            one.set_gamma(one.assembly.automatic_gamma)
        self._softer += changed

    def solve(
        self,
        solver: Any,
        softening: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> int:
        """Solve roughly from the present state, within what `softening` makes; return
        the iterations. Collective."""
        given = [one.gamma for one, _ in self._softer]
        try:
            _soften(self._softer)
            with softening():
                return solve_roughly(solver)
        finally:
            for (one, _), gamma in zip(self._softer, given):
                one.set_gamma(gamma)


def propose_nodes(problem: Any) -> list[str]:
    """Sentences on contacts that a law at nodes suits better, at a state that is no
    failed iterate. Collective."""
    try:
        contacts = _that_bend(problem)
    except FAILURES:  # on all ranks: the failure that is told of counts
        return []
    return [
        f"{' and '.join(zone.facets.spoken for zone in one.zones)} bends under contact, "
        "or its master does, which takes many iterations with the law at points: try "
        "AugmentedLagrangian(condition='nodes'), whose gamma accounts for bending"
        for one, _ in contacts
    ]


def _that_bend(problem: Any) -> list[tuple[Any, Any]]:
    """Contacts with a law at points and a coefficient far above what their surfaces
    yield, or one that has stayed soft, and soft coefficients of them. Collective."""
    contact = problem.contact
    return [
        (one, gamma)
        for one, gamma in zip(contact.contacts, contact.softer(problem.bcs))
        if gamma is not None
        and (
            one.assembly.gamma_is_soft
            or _largest(gamma) < BENDS * one.assembly.gamma_scale
        )
    ]


def _is_automatic(pair: tuple[Any, Any]) -> bool:
    """Whether a contact has its automatic coefficient: no other is replaced."""
    one, _ = pair
    return one.gamma is not None and one.gamma is one.assembly.automatic_gamma


def _soften(contacts: list[tuple[Any, Any]]) -> None:
    """Set soft coefficients. Collective."""
    for one, gamma in contacts:
        one.set_gamma(gamma)
        one.assembly.soft_gamma = one.gamma


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
