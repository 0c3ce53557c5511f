"""Paths of a prescribed load factor, and the sizes of their steps."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from ..compat import Array, Mask
from ..errors import ContactError


class StepSizes:
    """Halve steps after failures and let them grow after easy ones.

    Sizes are counted in first steps. As halves they are exact: halved steps that grow
    again end where the user's steps end.
    """

    def __init__(
        self, steps: int, max_halvings: int, largest: float, easy: float
    ) -> None:
        self._all, self._least = float(steps), 0.5**max_halvings
        self._largest, self._easy = largest, easy
        self._done, self.size, self._last = 0.0, 1.0, 1.0

    @property
    def ended(self) -> bool:
        """Whether the path is at its end."""
        return self._done == self._all

    @property
    def share(self) -> float:
        """Share of the path after the next step."""
        return (self._done + self.size) / self._all

    @property
    def part(self) -> float:
        """Size of the next step as a share of the path."""
        return self.size / self._all

    @property
    def ratio(self) -> float:
        """Size of the next step over the size of the last accepted one."""
        return self.size / self._last

    @property
    def is_smallest(self) -> bool:
        """Whether the next step is of the smallest size."""
        return self.size <= self._least

    def halve(self) -> bool:
        """Halve the next step; return False if it is the smallest."""
        if self.is_smallest:
            return False
        self.size = max(0.5 * self.size, self._least)
        return True

    def accept(self, iterations: int) -> None:
        """Accept the step and choose the size of the next one."""
        self._done += self.size
        self._last = self.size
        is_easy = 2.0 * self.size <= self._largest and iterations <= self._easy
        may_grow = self.size < 1.0 or is_easy
        if may_grow and self._done % (2.0 * self.size) == 0.0:
            self.size *= 2.0
        while self.size > self._all - self._done > 0.0:
            self.size *= 0.5


class ArcSizes(StepSizes):
    """Let the iterations of each step decide the next radius, in first radii."""

    def accept(self, iterations: int) -> None:
        easy = max(self._easy, 1) / max(iterations, 1)
        # However small a step is, contact needs some iterations. So steps shrink only
        # above twice the iterations of an easy step, and halved steps grow again
        if self.size >= 1.0 and easy < 1.0:
            easy = min(1.0, 2.0 * easy)
        elif self.size < 1.0:
            easy *= 2.0
        grown = self.size * min(max(easy**0.5, 0.5), 2.0)
        most = 1.0 if self.size < 1.0 else self._largest
        self._last, self.size = self.size, min(max(grown, self._least), most)


class PrescribedPath:
    """Lead steps by the load factor, with which `apply` is called.

    `factor` is the load factor of the last accepted step.
    """

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        sizes: StepSizes,
    ) -> None:
        self._given, self._apply = solver, apply
        self._ends, self.sizes = ends, sizes
        self.factor = ends[0]

    @property
    def solver(self) -> Any:
        """Solver of a step after `begin`."""
        return self._given

    @property
    def led(self) -> Mask | None:
        """Whether an owned dof of u leads; None if the load factor does."""
        return None

    @property
    def led_weights(self) -> Array | None:
        """Weights of the owned dofs in a chosen displacement, if one leads."""
        return None

    @property
    def ended(self) -> bool:
        """Whether the path is at its end."""
        return self.sizes.ended

    @property
    def next(self) -> float:
        """Load factor of the next step; the path's end is met exactly."""
        begin, end = self._ends
        share = self.sizes.share
        return end if share == 1.0 else begin + share * (end - begin)

    @property
    def time(self) -> float:
        """Quantity that grows along the path, at the end of a solved step."""
        return self.factor

    @property
    def controlled(self) -> float:
        """Quantity that leads the path. Collective."""
        return self.time

    def begin(self) -> None:
        """Set the loads of the next step."""
        self._apply(self.next, self.next - self.factor)

    def set_first_loads(self) -> None:
        """Set the loads of the last accepted step in place of those of `begin`."""
        self._apply(self.factor, self.next - self.factor)

    def restart(self) -> None:
        """Go back to the last accepted step, whose state has been restored."""

    def extrapolate(self, ratio: float) -> None:
        """Extrapolate the load factor by a ratio of its last change."""

    def reached(self) -> None:
        """Take over the end of a solved step, before its results are recorded."""
        self.factor = self.next

    def accepted(self) -> None:
        """Go on from a step that has been recorded and accepted."""

    def describe(self) -> str:
        """Name the failed step for a message."""
        return f"load factor {self.next:.6g} failed"


def with_size(apply: Any) -> Callable[[float, float], Any]:
    """Pass the step size on if `apply` has two arguments without default.

    Raises
    ------
    ContactError
        If it can be called with neither one nor two arguments.
    """
    try:
        signature = inspect.signature(apply)
    except (TypeError, ValueError):  # some built-in functions have no signature
        return lambda factor, size: apply(factor)
    found = signature.parameters.values()
    positional = (p for p in found if p.kind <= p.POSITIONAL_OR_KEYWORD)
    count = 2 if sum(p.default is p.empty for p in positional) == 2 else 1
    try:
        signature.bind(*range(count))
    except TypeError as error:
        raise ContactError(
            "apply must be a function of the load factor, or of that and the step's "
            f"size, not of {signature} ({error})"
        ) from None
    return apply if count == 2 else lambda factor, size: apply(factor)
