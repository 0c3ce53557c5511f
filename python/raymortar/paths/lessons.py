"""Choice of the way that solves a step first: that of the last steps."""

from __future__ import annotations

from .prediction import Backoff

# Steps in a row that a way solves after the plain solver failed, until it goes first
ENOUGH = 2


class Lessons:
    """Remembers what solved the last steps of a path.

    A way that solved two steps in a row, in which the plain solver failed, goes first
    for 2 steps, then for 4 and 8. Between, the plain solver is tried again, and stays
    as soon as it works.
    """

    def __init__(self, plain: str) -> None:
        self._plain = self._way = plain
        self._in_row, self._backoff = 0, Backoff()  # of the plain solver

    @property
    def another_leads(self) -> bool:
        """Whether another way than the plain solver has solved the last steps."""
        return self._in_row >= ENOUGH

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
