"""Paths of time, and the sizes of their steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..errors import ContactError, Options, is_whole_number, positive
from ..paths.load_path import PrescribedPath, StepSizes

# Share of the size that the estimated error allows
SAFE = 0.9
# A step whose error is more than this many times the tolerance is refused
WORST = 2.0


@dataclass(frozen=True)
class Adaptive(Options):
    """Time steps whose sizes follow their Newton iterations and local errors.

    Parameters
    ----------
    error
        Local error of the displacement in a step, over the distance that the bodies
        would move in it at the largest velocity so far.
    easy
        Newton iterations of a step up to which the next one may be larger.
    largest
        Largest step, over `dt`.
    """

    error: float = 1e-2
    easy: int = 8
    largest: float = 1.0

    def check(self) -> None:
        positive("error", self.error)
        if positive("largest", self.largest) < 1.0:
            raise ContactError(f"largest = {self.largest!r} must be at least 1")
        if not (is_whole_number(self.easy) and self.easy > 0):
            raise ContactError(f"easy = {self.easy!r} must be a whole number above 0")


class AdaptiveSizes(StepSizes):
    """Sizes in first steps, by iterations and the local error of the last step.

    `error` is the local error of the solved step.
    """

    def __init__(self, steps: float, max_halvings: int, rule: Adaptive) -> None:
        super().__init__(1, max_halvings, rule.largest, rule.easy)
        self._all, self._rule, self.error = steps, rule, 0.0
        self._fit()

    @property
    def share(self) -> float:
        """Share of the path after the next step."""
        end = self._done + self.size
        return 1.0 if end > self._all * (1.0 - 1e-9) else end / self._all

    def is_too_far(self, error: float) -> bool:
        """Note the error of a solved step; whether it is to be halved."""
        self.error = error
        return error > WORST * self._rule.error and self.size > self._least

    def accept(self, iterations: int) -> None:
        """Accept the step and choose the size of the next one."""
        self._done = self._all if self.share == 1.0 else self._done + self.size
        self._last = self.size
        grown = (self._easy / max(iterations, 1)) ** 0.5
        if self.error > 0.0:
            grown = min(grown, SAFE * (self._rule.error / self.error) ** 0.5)
        self.size = self.size * min(max(grown, 0.5), 2.0)
        self.size = min(max(self.size, self._least), self._largest)
        self._fit()

    def _fit(self) -> None:
        """Shorten the steps that are left alike, so that they meet the end."""
        left = self._all - self._done
        if left > 0.0:
            count = -(-left * (1.0 - 1e-9) // self.size)
            self.size = min(self.size, left / max(count, 1.0))


class TimePath(PrescribedPath):
    """Lead steps by the time, with which `apply` is called.

    Parameters
    ----------
    middle
        Whether a step is solved for its middle, whose loads are then set.
    started, solved, passed
        Functions that are called with a step's size when its loads have been set, when
        it is solved, and when it is recorded.
    """

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        sizes: StepSizes,
        middle: bool,
        started: Callable[[float], None],
        solved: Callable[[], None],
        passed: Callable[[], None],
    ) -> None:
        super().__init__(solver, apply, ends, sizes)
        self._middle = 0.5 if middle else 1.0
        self._started, self._solved, self._passed = started, solved, passed

    def begin(self) -> None:
        """Set the loads of the next step, and begin it."""
        dt = self.next - self.factor
        self._apply(self.factor + self._middle * dt, dt)
        self._started(dt)

    def reached(self) -> None:
        """Take over the end of a solved step, before its results are recorded."""
        self._solved()
        super().reached()

    def accepted(self) -> None:
        """Go over to the end of a recorded step."""
        self._passed()

    def describe(self) -> str:
        """Name the failed step for a message."""
        return f"time {self.next:.6g} failed"
