"""Predictions from earlier steps: where the next starts, and which way goes first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..core.state import State
from ..diagnose.failure import FAILURES
from ..viscous.budget import Backoff
from .load_path import PrescribedPath

# Share of displacements that is rounding error
ROUNDING = 1e-10
# Steps in a row that a way solves after the plain solver failed, until it goes first
ENOUGH = 2


class Prediction:
    """Extrapolates a state by the change of one of the last two steps.

    Where facets slide past facets, every other step is like the one before it. So the
    change is taken that leaves fewer forces out of balance
    (docs/measured/load_steps.md). Forces tell of a path that turns round, or touches,
    too: fewer of them must be out of balance than where the last step ended, and
    prescribed displacements nearer. A start that fails is left out for 1, 2, 4, 8 steps;
    those that the user asks for are `always` taken.
    """

    def __init__(self, path: PrescribedPath, always: bool = False) -> None:
        self._path, self._problem, self.always = path, path.solver.problem, always
        self._backoff = Backoff()
        # Starts of the last two accepted steps, and their sizes
        self._begun: list[tuple[State, float]] = []

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        return [*self._backoff.remember(), *(size for _, size in self._begun)]

    def recall(self, numbers: Sequence[float], starts: Sequence[State]) -> None:
        """Go on from numbers, and the starts of the last steps."""
        self._backoff.recall(numbers[:2])
        sizes = numbers[2:]
        self._begun = list(zip(starts[len(starts) - len(sizes) :], sizes))

    def accepted(self, begin: State, jumps: bool) -> None:
        """Note where an accepted step began. Steps up to a jump tell nothing of later
        ones."""
        size = self._path.sizes.size
        self._begun = [] if jumps else [*self._begun[-1:], (begin, size)]

    def leads_on(self, now: State, last: State, ratio: float) -> bool:
        """Go where one of the last steps leads; False: stay at the present state.
        Collective."""
        if not self.always and self._backoff.rests():
            return False
        changes = [*self._changes(now, last, ratio)]
        if self.always and len(changes) == 1:
            self._go(*changes[0])
            return True
        here = np.inf if self.always else self._imbalance()
        pending = self._problem.convergence.now.pending
        least, best, tried = here, None, None
        for change in changes:
            if tried is not None:
                self._stay(now)
            self._go(*change)
            size, tried = self._imbalance(), change
            if size < least and (self.always or self._is_nearer(pending)):
                least, best = size, change
        if best is not tried:
            self._stay(now)
            if best is not None:
                self._go(*best)
        return best is not None

    def _changes(
        self, now: State, last: State, ratio: float
    ) -> Iterator[tuple[State, State, float]]:
        """Yield the changes to go on with: end, begin and factor."""
        yield now, last, ratio
        if len(self._begun) == 2 and self._path.led is None:
            begin, size = self._begun[0]
            yield last, begin, self._path.sizes.size / size

    def _go(self, end: State, begin: State, factor: float) -> None:
        """Add a multiple of a change to the present state."""
        self._path.extrapolate(factor)
        self._problem.contact.states.extrapolate(end, begin, factor)

    def _stay(self, now: State) -> None:
        """Go back to the accepted state. Collective."""
        self._problem.contact.restore(now)
        self._path.restart()

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
        """Sum up what is out of balance at the present state, infinite where no solve
        can start. Force. Collective."""
        problem: Any = self._problem
        x, b = problem.create_vector(), problem.create_vector()
        try:
            try:
                problem.start(x)
            except FAILURES:
                return np.inf
            problem.F(x, b)
            return float(problem.convergence.now.norm)
        finally:
            x.destroy()
            b.destroy()


class Lessons:
    """Remembers what solved the last steps of a path.

    A way that solved two steps in a row, in which the plain solver failed, goes first
    for 2 steps, then for 4 and 8. Between, the plain solver is tried again, and stays
    as soon as it works.
    """

    def __init__(self, plain: str) -> None:
        self._plain = self._way = plain
        self._in_row, self._backoff = 0, Backoff()  # of the plain solver

    def remember(self, ways: Sequence[str]) -> list[float]:
        """Numbers from which `recall` goes on, given all ways."""
        return [ways.index(self._way), self._in_row, *self._backoff.remember()]

    def recall(self, numbers: Sequence[float], ways: Sequence[str]) -> None:
        """Go on from numbers."""
        self._way, self._in_row = ways[int(numbers[0])], int(numbers[1])
        self._backoff.recall(numbers[2:])

    @property
    def another_leads(self) -> bool:
        """Whether another way than the plain solver has solved the last steps."""
        return self._in_row >= ENOUGH

    @property
    def last(self) -> str:
        """Name the way that solved the last step."""
        return self._way

    def first(self) -> str:
        """Name the way to begin this step with."""
        if not self.another_leads or not self._backoff.rests():
            return self._plain
        return self._way

    def solved(self, way: str, plain_failed: bool) -> None:
        """Note which way solved a step, and whether the plain solver failed in it."""
        if way != self._way:
            self._way, self._in_row = way, 0
            self._backoff.reset()
        self._in_row += way != self._plain
        if plain_failed:
            self._backoff.failed()
