"""Sizes of steps: halved after failures, grown again after easy ones."""

from __future__ import annotations


class StepSizes:
    """Position on a path and size of the next step, as whole numbers.

    The unit is the smallest step. So the path ends at exactly 1, and halved steps that
    grow again end where the user's steps end.

    Parameters
    ----------
    steps, max_halvings, largest, easy
        As of `LoadSteps`.
    """

    def __init__(
        self, steps: int, max_halvings: int, largest: float, easy: float
    ) -> None:
        self._unit = 2**max_halvings
        self._all = steps * self._unit
        self._largest, self._easy = largest, easy
        self._done, self._size, self._last = 0, self._unit, self._unit

    @property
    def ended(self) -> bool:
        """Whether the path is at its end."""
        return self._done == self._all

    @property
    def share(self) -> float:
        """Share of the path after the next step."""
        return (self._done + self._size) / self._all

    @property
    def part(self) -> float:
        """Size of the next step, as a share of the path."""
        return self._size / self._all

    @property
    def ratio(self) -> float:
        """Size of the next step over that of the last accepted one."""
        return self._size / self._last

    def halve(self) -> bool:
        """Halve the next step, if that may be."""
        if self._size == 1:
            return False
        self._size //= 2
        return True

    def accept(self, iterations: int) -> None:
        """Accept the step. The next one may be larger."""
        self._done += self._size
        self._last = self._size
        if self._may_grow(iterations) and self._done % (2 * self._size) == 0:
            self._size *= 2
        while self._size > self._all - self._done > 0:
            self._size //= 2

    def _may_grow(self, iterations: int) -> bool:
        """Whether the next step may be twice as large."""
        if self._size < self._unit:
            return True
        allowed = self._largest * self._unit
        return 2 * self._size <= allowed and iterations <= self._easy


class ArcSizes:
    """Radii of arcs. The iterations of each step decide the next radius.

    Parameters
    ----------
    max_halvings, largest, easy
        As of `LoadSteps`.
    first
        First radius. None: not known yet.

    Attributes
    ----------
    ratio
        Size of the next step over that of the last accepted one.
    """

    def __init__(
        self, max_halvings: int, largest: float, easy: float, first: float | None
    ) -> None:
        self.first, self.ratio = first, 1.0
        self._least, self._largest = 0.5**max_halvings, largest
        # In first radii
        self._size, self._easy = 1.0, max(easy, 1)

    @property
    def radius(self) -> float | None:
        """Radius of the next step."""
        return None if self.first is None else self._size * self.first

    def halve(self) -> bool:
        """Halve the next step, if that may be."""
        if self._size <= self._least:
            return False
        size = max(0.5 * self._size, self._least)
        self.ratio *= size / self._size
        self._size = size
        return True

    def accept(self, iterations: int) -> None:
        """The step is done; the next one may be larger."""
        easy = self._easy / max(iterations, 1)
        # However small a step is, contact needs some iterations. So steps shrink only
        # above twice the iterations of an easy step, and halved steps grow again
        if self._size >= 1.0 and easy < 1.0:
            easy = min(1.0, 2.0 * easy)
        elif self._size < 1.0:
            easy *= 2.0
        grown = self._size * min(max(easy**0.5, 0.5), 2.0)
        most = 1.0 if self._size < 1.0 else self._largest
        grown = min(max(grown, self._least), most)
        self.ratio, self._size = grown / self._size, grown
